"""Reads all frames of a capture once, and keeps downscaled pictures and read errors."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.findings import Finding, format_names

_COLUMNS = 96
_MAX_KEPT = 240  # frames: later pictures are read but not kept

Advance = Callable[[int, int], object]


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Downscaled gray pictures of a camera.

    Attributes:
        side: Factor by which pictures are downscaled.
        gray_pictures: `[T, rows, columns]` levels of 255, times 128, of the first frames.
        is_there: `[T]` whether a frame could be read.
        faults: Error messages of frames that could not be read, by frame.
    """

    side: int
    gray_pictures: NDArray[np.uint16]
    is_there: NDArray[np.bool_]
    faults: dict[int, str]

    @property
    def changes(self) -> NDArray[np.float32]:
        """`[T - 1, rows, columns]` absolute differences of successive frames, levels."""
        steps = np.abs(np.diff(self.gray_pictures.astype(np.float32), axis=0)) / np.float32(_SCALE)
        steps[~(self.is_there[1:] & self.is_there[:-1])] = 0
        return steps.astype(np.float32, copy=False)


_SCALE = 128


def record(capture: Capture, advance: Advance) -> list[Recording]:
    """Record all cameras, reading every frame.

    Args:
        capture: The capture; held-out cameras are included.
        advance: Called with the number of pictures read so far, and the total.
    """
    total = len(capture.cameras) * capture.frame_count
    recordings = []
    for index, camera in enumerate(capture.cameras):
        side = max(1, camera.width // _COLUMNS)
        kept = min(_MAX_KEPT, capture.frame_count)
        gray_pictures = np.zeros(
            (kept, camera.height // side, camera.width // side), dtype=np.uint16
        )
        faults: dict[int, str] = {}
        for frame in range(capture.frame_count):
            try:
                picture = capture.image(index, frame)
            except CaptureError as error:
                faults[frame] = str(error)
            else:
                if frame < kept:
                    gray_pictures[frame] = _shrink(picture, side)
            advance(index * capture.frame_count + frame + 1, total)
        is_there = np.array([frame not in faults for frame in range(kept)])
        recordings.append(Recording(side, gray_pictures, is_there, faults))
    return recordings


def find_unreadable(names: list[str], recordings: list[Recording]) -> Iterator[Finding]:
    """Yield a finding for each camera with unreadable frames."""
    for name, recording in zip(names, recordings, strict=True):
        if recording.faults:
            first = min(recording.faults)
            frames = format_names([str(frame) for frame in sorted(recording.faults)])
            message = f"frame {frames} of {name} cannot be read: {recording.faults[first]}"
            yield Finding("unreadable-frame", message, (name,))


def _shrink(picture: Image, side: int) -> NDArray[np.uint16]:
    rows, columns = picture.shape[0] // side, picture.shape[1] // side
    squares = picture[: rows * side, : columns * side].reshape(rows, side, columns, 3 * side)
    sums = squares.sum(axis=(1, 3), dtype=np.uint32)
    means: NDArray[np.uint16] = (sums * (_SCALE / (3 * side * side)) + 0.5).astype(np.uint16)
    return means
