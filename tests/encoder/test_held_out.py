"""An encode never reads the pictures of held-out cameras."""

import io
from pathlib import Path

import numpy as np
import pytest

from quarc_ref.datasets import capture_media as opening
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder import EncodeOptions, encode
from tests.datasets import scenes
from tests.encoder.toys import SMALL

_HELD_OUT = "cam01"


class HeldOutReadError(AssertionError):
    """A held-out picture was read."""


class _GuardedSource:
    """A picture source that raises an error if the pictures of a camera are read."""

    def __init__(self, source, forbidden):
        self._source = source
        self._forbidden = forbidden
        self.requests = set()

    def read(self, camera, frame):
        if camera == self._forbidden:
            message = f"frame {frame} of the held-out camera"
            raise HeldOutReadError(message)
        self.requests.add((camera, frame))
        return self._source.read(camera, frame)


@pytest.fixture
def guarded_capture(tmp_path, monkeypatch) -> tuple[Path, list[_GuardedSource]]:
    """A capture without initial points, and the guards of its picture sources."""
    shots, guards = scenes.make_shots(6, (160, 120), 150.0), []
    for shot in shots:
        picture = scenes.render(shot, painting=scenes.paint_grains, samples=4)
        scenes.write_video(tmp_path / f"{shot.name}.mp4", [picture] * 3)
    np.save(tmp_path / "poses_bounds.npy", [scenes.make_poses_row(shot) for shot in shots])
    original_class = opening.RectifiedPictures

    def guard(source, names, rectifiers):
        guards.append(_GuardedSource(source, names.index(_HELD_OUT)))
        return original_class(guards[-1], names, rectifiers)

    monkeypatch.setattr(opening, "RectifiedPictures", guard)
    return tmp_path, guards


def test_held_out_alpha_is_never_read_during_an_encode(guarded_capture, monkeypatch):
    folder, guards = guarded_capture
    for camera in range(6):
        path = folder / "masks" / f"cam{camera + (camera > 1):02d}.png"
        scenes.write_picture(path, np.full((120, 160, 3), 255, np.uint8))
    write_capture_notes(folder / NOTES_NAME, CaptureNotes(has_transparent_background=True))
    original_class, alpha_guards = opening.RectifiedAlphas, []

    def guard(source, rectifiers):
        alpha_guards.append(_GuardedSource(source, 1))
        return original_class(alpha_guards[-1], rectifiers)

    monkeypatch.setattr(opening, "RectifiedAlphas", guard)
    capture = open_capture(folder, CaptureOptions(held_out=(_HELD_OUT,)))
    encode(capture, io.BytesIO(), EncodeOptions(SMALL, device="cpu", checks=False))

    for sources in (guards, alpha_guards):
        assert {camera for camera, _ in sources[0].requests} == {0, 2, 3, 4, 5}


def test_held_out_pictures_are_never_read_during_an_encode(guarded_capture):
    folder, guards = guarded_capture
    capture = open_capture(folder, CaptureOptions(held_out=(_HELD_OUT,)))
    sink = io.BytesIO()
    encode(capture, sink, EncodeOptions(SMALL, device="cpu"))

    (guard,) = guards
    frames = {frame for _, frame in guard.requests}
    cameras = {camera for camera, _ in guard.requests}
    assert frames == {0, 1, 2}
    assert cameras == {0, 2, 3, 4, 5}
    assert len(sink.getvalue()) > 1000


def test_the_guard_detects_a_read(guarded_capture):
    folder, _ = guarded_capture
    capture = open_capture(folder, CaptureOptions(held_out=(_HELD_OUT,)))

    with pytest.raises(HeldOutReadError, match="frame 2"):
        capture.image(capture.held_out[0], 2)
