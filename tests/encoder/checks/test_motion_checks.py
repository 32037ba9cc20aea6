import numpy as np
import pytest

from quarc_ref.encoder.checks.motion_checks import find_motion_faults
from quarc_ref.encoder.checks.recording import GrayFrames, Recording, read_recordings
from tests.encoder.toys import make_cameras
from tests.encoder.transparent_toys import make_subject_capture

_FRAME_COUNT = 5


def _make_recording(seed: int, unreadable_frames=(), *, is_frozen: bool = False) -> Recording:
    """Return a recording of noise, or of a single picture."""
    rng = np.random.default_rng(seed)
    pictures = rng.integers(0, 255 * 128, (_FRAME_COUNT, 6, 8)).astype(np.uint16)
    if is_frozen:
        pictures[:] = pictures[0]
    pictures[list(unreadable_frames)] = 0
    is_usable = ~np.isin(np.arange(_FRAME_COUNT), unreadable_frames)
    frames = GrayFrames(np.arange(_FRAME_COUNT), pictures, is_usable)
    return Recording(1, frames, frames, dict.fromkeys(unreadable_frames, "damaged"))


@pytest.mark.parametrize("unreadable_frames", [(), (1, 3), (0, 1, 2, 3, 4)])
def test_a_camera_with_unreadable_frames_is_not_frozen(unreadable_frames):
    recordings = [_make_recording(0), _make_recording(1, unreadable_frames), _make_recording(2)]

    assert list(find_motion_faults(make_cameras(3), recordings)) == []


def test_the_only_readable_camera_is_not_frozen():
    unreadable = _make_recording(1, range(_FRAME_COUNT))

    recordings = [_make_recording(0), unreadable, unreadable]
    assert list(find_motion_faults(make_cameras(3), recordings)) == []


def test_a_camera_that_does_not_see_the_subject_is_not_frozen():
    capture = make_subject_capture(seen_by=[0, 1, 3])

    recordings = read_recordings(capture, lambda *_: None)

    assert [recording.first_frames.is_usable.all() for recording in recordings] == [
        True,
        True,
        False,
        True,
    ]
    assert not recordings[2].first_frames.is_usable.any()
    assert list(find_motion_faults(capture.cameras, recordings)) == []


def test_one_of_two_cameras_is_frozen():
    recordings = [_make_recording(0), _make_recording(1, is_frozen=True)]

    findings = list(find_motion_faults(make_cameras(2), recordings))

    assert [finding.kind for finding in findings] == ["frozen-camera"]


@pytest.mark.parametrize("unreadable_frames", [(), (1,)])
def test_a_frozen_camera_is_found(unreadable_frames):
    frozen = _make_recording(1, unreadable_frames, is_frozen=True)
    recordings = [_make_recording(0), frozen, _make_recording(2)]

    findings = list(find_motion_faults(make_cameras(3), recordings))

    assert [(finding.kind, finding.cameras) for finding in findings] == [
        ("frozen-camera", ("cam01",))
    ]
