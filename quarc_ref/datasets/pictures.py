"""Where a capture's pictures come from: videos, picture files, and rectified ones.

Each is a `PictureSource`; `RectifiedPictures` stands before one of the others
and is where a picture of another size than the calibration says is refused.
"""

import math
from collections.abc import Sequence
from pathlib import Path

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.capture import Image, PictureSource
from quarc_ref.datasets.errors import CountMismatchError, UnreadableVideoError
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.datasets.video import VideoReader, read_still

_RATE_TOLERANCE = 1e-3  # 29.97 and 30 differ by as much, and are taken for one


class VideoPictures:
    """Pictures of one video to a camera.

    Args:
        readers: `[camera]`, at least one.

    Attributes:
        readers: As given.
        frame_count: Frames that every video has.
        frames_per_second: Of all videos.

    Raises:
        CountMismatchError: The videos differ in frames or frame rate.
    """

    def __init__(self, readers: Sequence[VideoReader]) -> None:
        self.readers = tuple(readers)
        self.frame_count = self.readers[0].frame_count
        self.frames_per_second = self.readers[0].frames_per_second
        if not all(self._agrees(reader) for reader in self.readers):
            listing = ", ".join(
                f"{reader.path.stem} {reader.frame_count} at {reader.frames_per_second:g}/s"
                for reader in self.readers
            )
            message = f"videos differ in frames or frame rate: {listing}; cut them to one length"
            raise CountMismatchError(message)

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        return self.readers[camera].read(frame)

    def _agrees(self, reader: VideoReader) -> bool:
        same_rate = math.isclose(
            reader.frames_per_second, self.frames_per_second, rel_tol=_RATE_TOLERANCE
        )
        return same_rate and reader.frame_count == self.frame_count


class FilePictures:
    """Pictures of one file to a camera and frame.

    Args:
        paths: `[camera][frame]`.
        lenses: `[camera]`; files of other sizes are not decoded.
    """

    def __init__(self, paths: Sequence[Sequence[Path]], lenses: Sequence[Lens]) -> None:
        self._paths = tuple(tuple(row) for row in paths)
        self._sizes = tuple((lens.width, lens.height) for lens in lenses)

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        return read_still(self._paths[camera][frame], self._sizes[camera])


class RectifiedPictures:
    """Pictures of another source, made pinhole pictures.

    Args:
        source: Of the pictures on disk.
        names: `[camera]` for messages.
        rectifiers: `[camera]`.
    """

    def __init__(
        self, source: PictureSource, names: Sequence[str], rectifiers: Sequence[Rectifier]
    ) -> None:
        self._source = source
        self._names = tuple(names)
        self._rectifiers = tuple(rectifiers)

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        picture = self._source.read(camera, frame)
        lens = self._rectifiers[camera].source
        height, width = picture.shape[:2]
        if (width, height) != (lens.width, lens.height):
            message = (
                f"frame {frame} of camera {self._names[camera]} is {width}x{height}, but its "
                f"calibration is for {lens.width}x{lens.height}: scale one to the other"
            )
            raise UnreadableVideoError(message)
        return self._rectifiers[camera].rectify(picture)
