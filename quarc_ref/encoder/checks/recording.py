"""Reads all frames of a capture once, and stores downscaled pictures and read errors."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.ignored_frames import suggest_ignoring

_TARGET_COLUMNS = 96
_MAX_STORED_FRAMES = 240  # pictures of later frames are read but not stored

ReportProgress = Callable[[int, int], object]


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Downscaled gray pictures and read errors of a camera.

    Attributes:
        block_size: Integer factor by which width and height are reduced.
        gray_pictures: `[T, rows, columns]` gray levels (0 to 255) of the first T frames,
            multiplied by 128.
        is_usable: `[T]` whether a frame is used (`Capture.is_used`), could be read and, if the
            background is transparent, shows something of the subject.
        read_errors: Error message of each frame that could not be read, by frame index.
    """

    block_size: int
    gray_pictures: NDArray[np.uint16]
    is_usable: NDArray[np.bool_]
    read_errors: dict[int, str]

    @property
    def is_change_known(self) -> NDArray[np.bool_]:
        """`[T - 1]` whether both frames of a change are usable."""
        return self.is_usable[1:] & self.is_usable[:-1]

    @property
    def gray_levels(self) -> NDArray[np.float32]:
        """The `[T, rows, columns]` gray levels, 0 to 255."""
        return self.gray_pictures.astype(np.float32) / np.float32(_GRAY_SCALE)

    @property
    def changes(self) -> NDArray[np.float32]:
        """The `[T - 1, rows, columns]` absolute differences of consecutive frames, 0 to 255.

        Unknown changes are 0.
        """
        differences = np.abs(np.diff(self.gray_levels, axis=0))
        differences[~self.is_change_known] = 0
        return differences


_GRAY_SCALE = 128


def read_recordings(capture: Capture, advance: ReportProgress) -> list[Recording]:
    """Read every frame of all cameras, and return a recording of each camera.

    Args:
        capture: The capture; held-out cameras are read as well.
        advance: Called with the number of pictures read so far and the total number.
    """
    total = len(capture.cameras) * capture.frame_count
    recordings = []
    for index, camera in enumerate(capture.cameras):
        block_size = max(1, min(camera.width // _TARGET_COLUMNS, camera.height))
        stored_count = min(_MAX_STORED_FRAMES, capture.frame_count)
        gray_pictures = np.zeros(
            (stored_count, camera.height // block_size, camera.width // block_size), dtype=np.uint16
        )
        is_usable = np.zeros(stored_count, dtype=bool)
        read_errors: dict[int, str] = {}
        for frame in range(capture.frame_count):
            if not capture.is_used(index, frame):
                continue
            try:
                picture = capture.image(index, frame)
            except CaptureError as error:
                read_errors[frame] = str(error)
            else:
                if frame < stored_count:
                    gray_pictures[frame] = _downscale(picture, block_size)
                    is_usable[frame] = capture.alphas is None or picture.any()
            advance(index * capture.frame_count + frame + 1, total)
        recordings.append(Recording(block_size, gray_pictures, is_usable, read_errors))
    return recordings


def find_unreadable(
    names: list[str], recordings: list[Recording], start: int = 0
) -> Iterator[Finding]:
    """Yield a finding for each camera with unreadable frames.

    Args:
        names: Names of the cameras.
        recordings: Recording of each camera.
        start: Frame of the synchronized recording that is frame 0 of the recordings.
    """
    for name, recording in zip(names, recordings, strict=True):
        if recording.read_errors:
            first_error = recording.read_errors[min(recording.read_errors)]
            frames = [start + frame for frame in sorted(recording.read_errors)]
            message = (
                f"{name} has unreadable frames ({format_names([*map(str, frames)])}): "
                f"{first_error}, or {suggest_ignoring(name, frames)}"
            )
            yield Finding("unreadable-frame", message, (name,))


def _downscale(picture: Image, block_size: int) -> NDArray[np.uint16]:
    rows, columns = picture.shape[0] // block_size, picture.shape[1] // block_size
    squares = picture[: rows * block_size, : columns * block_size].reshape(
        rows, block_size, columns, 3 * block_size
    )
    sums = squares.sum(axis=(1, 3), dtype=np.uint32)
    means: NDArray[np.uint16] = (sums * (_GRAY_SCALE / (3 * block_size * block_size)) + 0.5).astype(
        np.uint16
    )
    return means
