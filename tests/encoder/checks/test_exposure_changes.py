import numpy as np
import pytest

from quarc_ref.encoder.checks.exposure_changes import find_exposure_changes
from quarc_ref.encoder.checks.recording import GrayFrames, Recording

_FRAME_COUNT = 6
_NAMES = [f"cam{index:02}" for index in range(4)]
_SLOW = np.linspace(1, 1.12, _FRAME_COUNT)


def _make_recording(seed, gains=1.0, unreadable_frames=(), black_share=0.0):
    """Return a recording of a still scene, a quarter of which an object crosses."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(40, 180, (1, 12, 16)), _FRAME_COUNT, axis=0)
    for frame in range(_FRAME_COUNT):
        levels[frame, :, frame : frame + 4] = 200
    levels[:, : round(12 * black_share)] = 0
    levels *= np.broadcast_to(gains, _FRAME_COUNT)[:, None, None]
    levels[list(unreadable_frames)] = 0
    is_usable = ~np.isin(np.arange(_FRAME_COUNT), unreadable_frames)
    pictures = np.round(levels * 128).astype(np.uint16)
    frames = GrayFrames(np.arange(_FRAME_COUNT), pictures, is_usable)
    return Recording(1, frames, frames, dict.fromkeys(unreadable_frames, "damaged"))


def _find(*recordings):
    return list(find_exposure_changes(_NAMES, recordings))


@pytest.mark.parametrize("unreadable_frames", [(), (0,), (2, 5)])
def test_a_camera_whose_exposure_changes_is_found(unreadable_frames):
    still = [_make_recording(seed) for seed in range(3)]

    (finding,) = _find(*still, _make_recording(3, _SLOW, unreadable_frames))

    assert (finding.kind, finding.cameras) == ("exposure-changes", ("cam03",))
    if not unreadable_frames:
        assert "cam03 by 12 %" in finding.message


def test_a_frame_that_no_camera_has_is_left_out():
    recordings = [_make_recording(seed, unreadable_frames=(3,)) for seed in range(3)]

    (finding,) = _find(*recordings, _make_recording(3, _SLOW, (3,)))

    assert finding.cameras == ("cam03",)


@pytest.mark.parametrize("gains", [1.0, _SLOW, [1, 1, 1, 0.001, 1, 1]])
def test_a_change_of_all_cameras_is_one_of_the_light(gains):
    assert _find(*(_make_recording(seed, gains) for seed in range(4))) == []


def test_cameras_that_differ_but_do_not_change_are_not_found():
    gains = [0.8, 1.0, 1.1, 1.2]

    assert _find(*(_make_recording(seed, gain) for seed, gain in enumerate(gains))) == []


@pytest.mark.parametrize(
    "unusable", [{"unreadable_frames": range(1, _FRAME_COUNT - 1)}, {"black_share": 0.8}]
)
def test_a_camera_that_shows_too_little_is_not_judged(unusable):
    still = [_make_recording(seed) for seed in range(3)]

    assert _find(*still, _make_recording(3, _SLOW, **unusable)) == []


def test_two_cameras_are_not_compared():
    assert _find(_make_recording(0), _make_recording(1, _SLOW)) == []
