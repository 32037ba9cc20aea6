"""Sources of the pictures of a capture: videos, picture files, and rectified pictures.

Each class is a `PictureSource`. Pictures whose size differs from the calibration are rejected:
picture files when their headers are read, video frames when they are decoded.
"""

from collections.abc import Collection, Sequence
from pathlib import Path
from statistics import median_high
from typing import Protocol

from quarc_ref.datasets.agreement import require_common_frame_rate
from quarc_ref.datasets.capture import Image, PictureSource
from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.media import read_still_size
from quarc_ref.datasets.stills import read_still
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.datasets.video import UNSTATED_MATRIX, VideoReader

DEFAULT_FRAMES_PER_SECOND = 30.0  # for picture files, which state no frame rate
Size = tuple[int, int]


class Pictures(PictureSource, Protocol):
    """Pictures as stored on disk.

    Attributes:
        paths: `[camera]` video files, or `[camera][frame]` picture files.
        sizes: `[camera]` width and height, pixels.
        lengths: `[camera]` number of frames.
        rotations: `[camera]` rotation flag of the video, in degrees counterclockwise.
        hdr_flags: `[camera]` whether the video is HDR.
        color_matrices: `[camera]` matrix that the video states, as in `VideoReader`.
        pixel_aspects: `[camera]` width of a pixel divided by its height, as in `VideoReader`.
        frame_rates: `[camera]` frames per second, which `require_common_frame_rate` accepts.
        frames_per_second: Frame rate of all cameras, the median.
    """

    paths: tuple[tuple[Path, ...], ...]
    sizes: tuple[Size, ...]
    lengths: tuple[int, ...]
    rotations: tuple[int, ...]
    hdr_flags: tuple[bool, ...]
    color_matrices: tuple[int, ...]
    pixel_aspects: tuple[float, ...]
    frame_rates: tuple[float, ...]
    frames_per_second: float


class VideoPictures:
    """Pictures that are stored in one video per camera; see `Pictures`.

    Args:
        readers: `[camera]` video readers, at least one.

    Raises:
        FrameRateError: The videos differ in frame rate, or a video has a variable frame rate.
    """

    def __init__(self, readers: Sequence[VideoReader]) -> None:
        self._readers = tuple(readers)
        require_common_frame_rate(self._readers)
        self.paths: tuple[tuple[Path, ...], ...] = tuple((reader.path,) for reader in readers)
        self.sizes = tuple((reader.width, reader.height) for reader in readers)
        self.lengths = tuple(reader.frame_count for reader in readers)
        self.rotations = tuple(reader.rotation for reader in readers)
        self.hdr_flags = tuple(reader.is_hdr for reader in readers)
        self.color_matrices = tuple(reader.color_matrix for reader in readers)
        self.pixel_aspects = tuple(reader.pixel_aspect for reader in readers)
        self.frame_rates = tuple(reader.frames_per_second for reader in readers)
        self.frames_per_second = median_high(self.frame_rates)

    def read(self, camera: int, frame: int) -> Image:
        """Read a picture, as described for `PictureSource.read`."""
        return self._readers[camera].read(frame)


class FilePictures:
    """Pictures that are stored in one file per camera and frame; see `Pictures`.

    Args:
        paths: `[camera][frame]` picture files, at least one frame per camera.
        sizes: `[camera]` width and height; files with other sizes are rejected. If None, the sizes
            of frame 0 are used.

    Raises:
        CaptureError: `sizes` is None, and the first picture of a camera cannot be read.
    """

    def __init__(
        self, paths: Sequence[Sequence[Path]], sizes: Sequence[Size] | None = None
    ) -> None:
        self.paths = tuple(tuple(camera_paths) for camera_paths in paths)
        self.sizes = tuple(
            sizes or (read_still_size(camera_paths[0]) for camera_paths in self.paths)
        )
        self.lengths = tuple(len(camera_paths) for camera_paths in self.paths)
        self.rotations = (0,) * len(self.paths)  # files with a rotation flag are rejected
        self.hdr_flags = (False,) * len(self.paths)
        self.color_matrices = (UNSTATED_MATRIX,) * len(self.paths)
        self.pixel_aspects = (1.0,) * len(self.paths)
        self.frame_rates = (DEFAULT_FRAMES_PER_SECOND,) * len(self.paths)
        self.frames_per_second = DEFAULT_FRAMES_PER_SECOND

    def read(self, camera: int, frame: int) -> Image:
        """Read a picture, as described for `PictureSource.read`."""
        return read_still(self.paths[camera][frame], self.sizes[camera])


class SynchronizedPictures:
    """Pictures of another source, synchronized by skipping frames at the start of recordings.

    Args:
        source: Source of the pictures on disk.
        first_frames: `[camera]` frame of `source` that becomes frame 0.
        ended: Cameras that may have fewer frames than the others, because these are never read.

    Attributes:
        first_frames: `[camera]` frame of the source that becomes frame 0.
        frame_count: Number of frames that all other cameras have; 0 or negative if there are none.
    """

    def __init__(
        self, source: Pictures, first_frames: Sequence[int], ended: Collection[int] = ()
    ) -> None:
        self._source = source
        self.first_frames = tuple(first_frames)
        self.frame_count = min(
            source.lengths[camera] - first
            for camera, first in enumerate(first_frames)
            if camera not in ended
        )

    def read(self, camera: int, frame: int) -> Image:
        """Read a picture, as described for `PictureSource.read`."""
        return self._source.read(camera, self.first_frames[camera] + frame)


class RectifiedPictures:
    """Pictures of another source, undistorted and downscaled.

    Args:
        source: Source of the pictures on disk.
        names: `[camera]` camera names for error messages.
        rectifiers: `[camera]` rectifiers of the pictures.
    """

    def __init__(
        self, source: PictureSource, names: Sequence[str], rectifiers: Sequence[Rectifier]
    ) -> None:
        self._source = source
        self._names = tuple(names)
        self._rectifiers = tuple(rectifiers)

    def read(self, camera: int, frame: int) -> Image:
        """Read a picture, as described for `PictureSource.read`."""
        picture = self._source.read(camera, frame)
        lens = self._rectifiers[camera].source_lens
        height, width = picture.shape[:2]
        if (width, height) != (lens.width, lens.height):
            message = (
                f"frame {frame} of camera {self._names[camera]} is {width}x{height}, but its "
                f"calibration is for {lens.width}x{lens.height}: resize the pictures, or "
                "scale the calibration"
            )
            raise UnreadableVideoError(message)
        return self._rectifiers[camera].rectify(picture)
