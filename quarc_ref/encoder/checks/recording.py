"""Reads all frames of a capture once, and stores downscaled pictures and read errors."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.ignored_frames import join_frames, suggest_ignoring

_TARGET_COLUMNS = 96
_MAX_STORED_FRAMES = 240
_GRAY_SCALE = 128

ReportProgress = Callable[[int, int], object]


@dataclass(frozen=True, slots=True, eq=False)
class GrayFrames:
    """Downscaled gray pictures of some frames of a camera.

    Attributes:
        frames: `[T]` the frames, in ascending order.
        pictures: `[T, rows, columns]` gray levels (0 to 255), multiplied by 128.
        is_usable: `[T]` whether a frame is used (`Capture.is_used`), could be read and, if the
            background is transparent, shows something of the subject.
    """

    frames: NDArray[np.intp]
    pictures: NDArray[np.uint16]
    is_usable: NDArray[np.bool_]

    @property
    def levels(self) -> NDArray[np.float32]:
        """The `[T, rows, columns]` gray levels, 0 to 255."""
        return self.pictures.astype(np.float32) / np.float32(_GRAY_SCALE)

    def rows(self, indices: NDArray[np.intp]) -> "GrayFrames":
        """Return the frames at some indices."""
        return GrayFrames(self.frames[indices], self.pictures[indices], self.is_usable[indices])


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Downscaled gray pictures and read errors of a camera.

    Attributes:
        block_size: Integer factor by which width and height are reduced.
        first_frames: Pictures of the first frames.
        samples: Pictures of frames that are evenly spaced over the whole recording; those of all
            frames if there are few.
        read_errors: Error message of each frame that could not be read, by frame index.
    """

    block_size: int
    first_frames: GrayFrames
    samples: GrayFrames
    read_errors: dict[int, str]

    @property
    def is_change_known(self) -> NDArray[np.bool_]:
        """`[T - 1]` whether both frames of a change in `first_frames` are usable."""
        is_usable = self.first_frames.is_usable
        return is_usable[1:] & is_usable[:-1]

    @property
    def changes(self) -> NDArray[np.float32]:
        """The `[T - 1, rows, columns]` absolute differences of consecutive frames, 0 to 255.

        Unknown changes are 0.
        """
        differences = np.abs(np.diff(self.first_frames.levels, axis=0))
        differences[~self.is_change_known] = 0
        return differences


def read_recordings(capture: Capture, advance: ReportProgress) -> list[Recording]:
    """Read every frame of all cameras, and return a recording of each camera.

    Args:
        capture: The capture; held-out cameras are read as well.
        advance: Called with the number of pictures read so far and the total number.
    """
    return [_read_recording(capture, index, advance) for index in range(len(capture.cameras))]


def _read_recording(capture: Capture, index: int, advance: ReportProgress) -> Recording:
    camera, frame_count = capture.cameras[index], capture.frame_count
    block_size = max(1, min(camera.width // _TARGET_COLUMNS, camera.height))
    first_count = min(_MAX_STORED_FRAMES, frame_count)
    sampled_frames = np.linspace(0, frame_count - 1, first_count).round().astype(np.intp)
    frames = np.union1d(np.arange(first_count), sampled_frames)
    shape = (len(frames), camera.height // block_size, camera.width // block_size)
    stored = GrayFrames(frames, np.zeros(shape, np.uint16), np.zeros(len(frames), dtype=bool))
    positions = {frame: position for position, frame in enumerate(frames.tolist())}
    read_errors: dict[int, str] = {}
    for frame in range(frame_count):
        try:
            picture = capture.image(index, frame)
        except CaptureError as error:
            read_errors[frame] = str(error)
        else:
            if frame in positions and capture.is_used(index, frame):
                position = positions[frame]
                stored.pictures[position] = _downscale(picture, block_size)
                stored.is_usable[position] = capture.alphas is None or picture.any()
        advance(index * frame_count + frame + 1, len(capture.cameras) * frame_count)
    return Recording(
        block_size,
        stored.rows(np.arange(first_count)),
        stored.rows(np.searchsorted(frames, sampled_frames)),
        read_errors,
    )


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
                f"{first_error}, or {suggest_ignoring(name, join_frames(frames))}"
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
