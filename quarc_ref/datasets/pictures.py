"""Where a capture's pictures come from: videos, picture files, and rectified ones.

Each is a `PictureSource`; `RectifiedPictures` stands before one of the others.
Pictures of another size than the calibration says are rejected: files by their
headers, frames of videos once they are decoded.
"""

from collections.abc import Sequence
from pathlib import Path

from quarc_ref.datasets.agreement import compare_lengths, require_one_rate
from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.capture import Image, PictureSource
from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.datasets.video import VideoReader, read_still


class VideoPictures:
    """Pictures of one video to a camera.

    Args:
        readers: `[camera]`, at least one.

    Attributes:
        readers: As given.
        frame_count: Frames that every video has.
        frames_per_second: Of all videos.
        uneven: What is wrong with the videos' lengths, if they differ.

    Raises:
        FrameRateError: The videos differ in frame rate, or one has a variable one.
    """

    def __init__(self, readers: Sequence[VideoReader]) -> None:
        self.readers = tuple(readers)
        require_one_rate(self.readers)
        self.frame_count = min(reader.frame_count for reader in self.readers)
        self.frames_per_second = self.readers[0].frames_per_second
        self.uneven = compare_lengths(self.readers)

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        return self.readers[camera].read(frame)


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
