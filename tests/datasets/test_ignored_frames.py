import json
import shutil

import numpy as np
import pytest

from quarc_ref.datasets import choose_points as choose_points_module
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import (
    CaptureError,
    MissingCameraError,
    StartError,
    UnreadableNotesError,
)
from quarc_ref.datasets.ignored_frames import IgnoredFrames
from quarc_ref.datasets.notes_file import read_capture_notes, write_capture_notes
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.checks.interlacing import find_interlaced_videos
from quarc_ref.encoder.segments import slice_capture
from tests.datasets import scenes

IGNORED = IgnoredFrames({"cam01": ((1, 1), (3, 4)), "cam03": ((2, None),)})


@pytest.fixture
def folder(n3dv_folder, tmp_path):
    """A capture of the cameras 00, 01, 03 and 04, with six frames."""
    return shutil.copytree(n3dv_folder, tmp_path / "plane")


def _write_notes(folder, **notes):
    (folder / NOTES_NAME).write_text(json.dumps(notes))


def test_notes_with_ignored_frames_survive_a_round_trip(tmp_path):
    notes = CaptureNotes({"cam01": 2.0}, ignored_frames=IGNORED)

    write_capture_notes(tmp_path / NOTES_NAME, notes)

    assert read_capture_notes(tmp_path) == notes
    written = json.loads((tmp_path / NOTES_NAME).read_text())
    assert written["ignored_frames"] == {"cam01": [1, [3, 4]], "cam03": [[2, None]]}


@pytest.mark.parametrize(
    ("camera", "frames"),
    [("cam00", set()), ("cam01", {1, 3, 4}), ("cam03", {2, 3, 4, 5})],
)
def test_spans_include_both_ends(camera, frames):
    assert {frame for frame in range(6) if IGNORED.contains(camera, frame)} == frames


@pytest.mark.parametrize(
    "value",
    [
        [],
        {"cam01": 3},
        {"cam01": ["3"]},
        {"cam01": [3.0]},
        {"cam01": [True]},
        {"cam01": [-1]},
        {"cam01": [None]},
        {"cam01": [[4, 3]]},
        {"cam01": [[1, 2, 3]]},
        {"cam01": [[None, 3]]},
        {"cam01": [[1, False]]},
        {"cam01": [[1, 1 << 40]]},
    ],
)
def test_malformed_spans_are_rejected(tmp_path, value):
    _write_notes(tmp_path, ignored_frames=value)

    with pytest.raises(UnreadableNotesError, match="ignored_frames"):
        read_capture_notes(tmp_path)


def test_ignored_pictures_are_black_masked_and_not_read(folder, monkeypatch):
    _write_notes(folder, ignored_frames=IGNORED.to_json())
    capture = open_capture(folder)
    read_pictures = []
    source_type = type(capture._source)
    read = source_type.read
    monkeypatch.setattr(
        source_type, "read", lambda self, *key: read_pictures.append(key) or read(self, *key)
    )

    for camera in range(4):
        for frame in range(6):
            is_used = (camera, frame) not in {
                (1, 1),
                (1, 3),
                (1, 4),
                *((2, f) for f in range(2, 6)),
            }
            picture, mask = capture.image(camera, frame), capture.mask(camera, frame)
            assert capture.is_used(camera, frame) is is_used
            assert picture.any() == is_used
            assert picture.shape == (32, 48, 3)
            assert (mask is None) == is_used
            assert is_used or (mask.shape == (32, 48) and not mask.any())
            assert ((camera, frame) in read_pictures) == is_used


def test_frames_are_counted_before_start(folder):
    _write_notes(folder, ignored_frames={"cam01": [[3, 4]]})

    capture = open_capture(folder, CaptureOptions(start=2))

    assert [capture.is_used(1, frame) for frame in range(4)] == [True, False, False, True]
    part = slice_capture(capture, 2, 2)
    assert [part.is_used(1, frame) for frame in range(2)] == [False, True]
    assert not part.image(1, 0).any()
    assert part.training_at(0) == (2, 3)


def test_ignored_alpha_is_transparent(folder):
    (folder / "masks").mkdir()
    for name in ("cam00", "cam01", "cam03", "cam04"):
        _write_white_mask(folder / "masks" / f"{name}.png")
    _write_notes(folder, background="transparent", ignored_frames={"cam01": [2]})

    capture = open_capture(folder)

    assert capture.alpha(1, 1).all()
    assert not capture.alpha(1, 2).any()
    assert not capture.mask(1, 2).any()
    assert capture.mask(1, 1) is None


def _write_white_mask(path):
    import cv2

    cv2.imwrite(str(path), np.full((32, 48), 255, np.uint8))


def test_points_are_triangulated_without_cameras_that_are_ignored_at_first(folder, monkeypatch):
    (folder / "points3D_init.ply").unlink()
    _write_notes(folder, ignored_frames={"cam03": [[2, 4]]})
    cameras_by_start = {}

    def triangulate(cameras, pictures):
        cameras_by_start[start] = [camera.name for camera in cameras]
        assert all(picture.any() for picture in pictures)
        raise CaptureError

    monkeypatch.setattr(choose_points_module, "triangulate", triangulate)
    for start in (0, 2):
        with pytest.raises(CaptureError):
            open_capture(folder, CaptureOptions(start=start))

    assert cameras_by_start == {0: ["cam01", "cam03", "cam04"], 2: ["cam01", "cam04"]}


def test_an_unknown_camera_is_rejected(folder):
    _write_notes(folder, ignored_frames={"cam02": [1]})

    with pytest.raises(MissingCameraError, match="cam02; the cameras are cam00, cam01, cam03"):
        open_capture(folder)


def test_a_frame_without_training_cameras_is_rejected(folder):
    spans = {"cam01": [[0, 3]], "cam03": [[2, None]], "cam04": [[1, 2], [5, 5]]}
    _write_notes(folder, ignored_frames=spans)

    with pytest.raises(MissingCameraError, match=r"no training camera in frame 2$"):
        open_capture(folder)
    open_capture(folder, CaptureOptions(max_frames=2))
    open_capture(folder, CaptureOptions(start=4, max_frames=1))
    with pytest.raises(MissingCameraError, match=r"no training camera in frame 2$"):
        open_capture(folder, CaptureOptions(start=2))


class _Recorder:
    """A picture source that remembers what is read."""

    def __init__(self):
        self.keys = []

    def read(self, camera, frame):
        self.keys.append((camera, frame))
        return np.zeros((32, 48, 3), np.uint8)


@pytest.mark.parametrize("offset", [0, 1])
def test_a_recording_that_ends_early_does_not_shorten_the_capture(folder, shots, offset):
    pictures = [scenes.render(shots[1], frame_time) for frame_time in range(3)]
    scenes.write_video(folder / "cam01.mp4", pictures)
    notes = {"offsets": {"cam01": offset}}

    _write_notes(folder, **notes, ignored_frames={"cam01": [[4 - offset, None]]})
    shortened = open_capture(folder)
    assert shortened.frame_count == 3 - offset
    assert [finding.kind for finding in shortened.findings] == ["uneven-lengths"]

    _write_notes(folder, **notes, ignored_frames={"cam01": [[3 - offset, None]]})
    capture = open_capture(folder)
    assert capture.frame_count == 6
    assert capture.findings == ()
    assert [capture.image(1, frame).any() for frame in range(6)] == [
        frame < 3 - offset for frame in range(6)
    ]
    capture.stored_pictures = _Recorder()
    list(find_interlaced_videos(capture))
    assert max(frame for camera, frame in capture.stored_pictures.keys if camera == 1) < 3 - offset
    assert open_capture(folder, CaptureOptions(start=5)).frame_count == 1
    with pytest.raises(StartError, match="6 frames"):
        open_capture(folder, CaptureOptions(start=6))


def test_the_ends_of_all_recordings_cannot_be_ignored(folder):
    names = ("cam00", "cam01", "cam03", "cam04")
    _write_notes(folder, ignored_frames={name: [[6, None]] for name in names})

    assert open_capture(folder).frame_count == 6


@pytest.mark.parametrize(
    "text",
    [
        '{"offsets": {}}',
        '{"offsets": {"cam01": 1}}',
        '{\n    "offsets": {"cam01": 1.0}, "up": [0, -1, 0]\n}\n',
    ],
)
def test_ignored_frames_do_not_change_the_fingerprint(folder, text):
    (folder / NOTES_NAME).write_text(text)
    fingerprint = open_capture(folder).fingerprint

    _write_notes(folder, **json.loads(text), ignored_frames={"cam01": [[3, None]]})
    assert open_capture(folder).fingerprint == fingerprint

    _write_notes(folder, offsets={"cam01": 2}, ignored_frames={"cam01": [[3, None]]})
    assert open_capture(folder).fingerprint != fingerprint


@pytest.mark.parametrize(
    "text",
    [
        '{"ignored_frames": {"cam01": [1]}, "ignored_frames": {"cam03": [2]}}',
        '{"ignored_frames": {"cam01": [1], "cam01": [2]}}',
    ],
)
def test_keys_that_repeat_are_rejected(folder, text):
    """If the advice of two findings is pasted, one of them would be lost."""
    (folder / NOTES_NAME).write_text(text)

    with pytest.raises(UnreadableNotesError, match=r"' is given twice: join the values"):
        read_capture_notes(folder)
