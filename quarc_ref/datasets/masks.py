"""Reads the masks of a capture, which select the pixels to use for training and evaluation.

White pixels are used and black pixels are ignored, as in COLMAP and nerfstudio. A camera has one
mask for all frames, one mask per frame, or no mask. Without a mask, all pixels are used. In a
capture with a transparent background, masks are the alpha of the pictures instead (`alphas`).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import (
    MASK_FOLDER_NAME,
    Files,
    is_video,
    list_picture_folders,
    list_single_pictures,
    list_videos,
)
from quarc_ref.datasets.capture import Alpha, Image, Mask, MaskSource
from quarc_ref.datasets.errors import MaskCountError, MaskNameError, MaskSizeError
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.pictures import FilePictures, Pictures, Size, VideoPictures
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.datasets.video import VideoReader
from quarc_ref.wording import format_count

_LOSSLESS_SUFFIX = ".png"
_WHITE_THRESHOLD = 127  # of 255; lossy compression changes black and white slightly
_LOSSY_BLACK, _LOSSY_WHITE = 16, 239  # of 255; darker and brighter levels are black and white


class FileMasks:
    """Masks as stored on disk.

    Args:
        files: `[camera]` mask files: one file for all frames, one file per frame, or no file.
        sizes: `[camera]` width and height of the pictures, pixels.
        lengths: `[camera]` number of frames.

    Attributes:
        paths: Mask files of all cameras.

    Raises:
        MaskSizeError: The first mask of a camera and the camera's pictures differ in size.
        MaskCountError: A camera has several masks, but not one mask per frame.
        CaptureError: A mask cannot be read.
    """

    def __init__(
        self, files: Sequence[Sequence[Path]], sizes: Sequence[Size], lengths: Sequence[int]
    ) -> None:
        self.paths = tuple(path for camera_files in files for path in camera_files)
        self._sources = [_open_masks(camera_files) for camera_files in files]
        for source, size, length in zip(self._sources, sizes, lengths, strict=True):
            if source is not None and source.sizes[0] != size:
                path, (width, height) = source.paths[0][0], source.sizes[0]
                message = (
                    f"mask {path} is {width}x{height}, but the pictures of its camera are "
                    f"{size[0]}x{size[1]}: resize the masks to the size of the pictures on disk"
                )
                raise MaskSizeError(message)
            if source is not None and source.lengths[0] not in (1, length):
                path, count = source.paths[0][0], source.lengths[0]
                message = (
                    f"the camera of {path} has {count} masks, but {format_count(length, 'frame')}: "
                    "a camera needs one mask for all frames, or one mask per frame"
                )
                raise MaskCountError(message)

    def read(self, camera: int, frame: int) -> Mask | None:
        """Read a mask, as described for `MaskSource.read`."""
        stored = self._read_stored(camera, frame)
        return None if stored is None else find_used_pixels(*stored)

    def read_alpha(self, camera: int, frame: int) -> Alpha | None:
        """Read a mask as alpha `[H, W]`, 0 to 255: white is opaque, and gray is translucent.

        Returns:
            The alpha; None if the camera has no mask.

        Raises:
            CaptureError: The mask cannot be read.
        """
        stored = self._read_stored(camera, frame)
        return None if stored is None else _measure_alpha(*stored)

    def _read_stored(self, camera: int, frame: int) -> tuple[Image, Path] | None:
        source = self._sources[camera]
        if source is None:
            return None
        picture = source.read(0, frame if source.lengths[0] > 1 else 0)
        return picture, source.paths[0][min(frame, len(source.paths[0]) - 1)]


class RectifiedMasks:
    """Masks that are undistorted, downscaled and synchronized like the pictures.

    Args:
        source: Masks of the pictures on disk.
        first_frames: `[camera]` frame on disk that becomes frame 0.
        rectifiers: `[camera]` rectifiers of the pictures.
    """

    def __init__(
        self, source: MaskSource, first_frames: Sequence[int], rectifiers: Sequence[Rectifier]
    ) -> None:
        self._source = source
        self._first_frames = tuple(first_frames)
        self._rectifiers = tuple(rectifiers)

    def read(self, camera: int, frame: int) -> Mask | None:
        """Read a mask, as described for `MaskSource.read`."""
        mask = self._source.read(camera, self._first_frames[camera] + frame)
        return None if mask is None else self._rectifiers[camera].rectify_mask(mask)


def find_used_pixels(picture: Image, path: Path) -> Mask:
    """Return which pixels a mask selects, `[H, W]`: those that are not black.

    Args:
        picture: The mask, `[H, W, 3]` sRGB.
        path: File of the mask. If its compression is lossy, dark gray counts as black.
    """
    threshold = 0 if path.suffix.lower() == _LOSSLESS_SUFFIX else _WHITE_THRESHOLD
    return np.asarray(picture.max(axis=2) > threshold)


def _measure_alpha(picture: Image, path: Path) -> Alpha:
    levels = picture.max(axis=2)
    if path.suffix.lower() == _LOSSLESS_SUFFIX:
        return np.asarray(levels)
    scale = 255 / (_LOSSY_WHITE - _LOSSY_BLACK)
    return np.asarray(
        np.rint(np.clip((levels.astype(np.float64) - _LOSSY_BLACK) * scale, 0, 255)), dtype=np.uint8
    )


def find_masks(
    folder: Path, names: Sequence[str]
) -> tuple[list[Sequence[Path]] | None, tuple[Finding, ...]]:
    """Find the masks of each camera in the folder `masks` of a capture.

    The masks of a camera are one file `NAME.png` for all frames, one file per frame, such as
    `NAME/0000.png`, or a video `NAME.mp4`. Masks named as in COLMAP (`NAME.png.png`) are found as
    well.

    Args:
        folder: Folder of the capture.
        names: `[camera]` names of the cameras.

    Returns:
        `[camera]` mask files, or None if no camera has a mask; and the findings, which contain one
        entry if some masks are not named after a camera.

    Raises:
        MaskNameError: The folder has masks, but none is named after a camera.
    """
    mask_folder = folder / MASK_FOLDER_NAME
    files_by_arrangement: list[Files] = [
        list_picture_folders(mask_folder),
        list_videos(mask_folder),
        {Path(name).stem: paths for name, paths in list_single_pictures(mask_folder).items()},
        list_single_pictures(mask_folder),
    ]
    files_by_name: Mapping[str, Sequence[Path]] = {
        name: paths for files in files_by_arrangement for name, paths in files.items()
    }
    files_by_camera = [files_by_name.get(name, ()) for name in names]
    used_paths = {path for paths in files_by_camera for path in paths}
    unused_names = sorted(
        name for name, paths in files_by_name.items() if not used_paths.issuperset(paths)
    )
    if not unused_names:
        return files_by_camera if used_paths else None, ()
    message = describe_unused_masks(mask_folder, unused_names, names)
    if not used_paths:
        raise MaskNameError(message)
    return files_by_camera, (Finding("mask-name", message),)


def describe_unused_masks(
    folder: Path, unused_names: Sequence[str], camera_names: Sequence[str]
) -> str:
    """Return an error message about masks that are not named after a camera.

    Args:
        folder: Folder of the masks.
        unused_names: Names of the masks that match no camera.
        camera_names: Names of the cameras.
    """
    return (
        f"{folder} has masks named {format_names(unused_names)}, which match no camera: name masks "
        f"after the cameras ({format_names(camera_names)}), such as {camera_names[0]}.png"
    )


def _open_masks(paths: Sequence[Path]) -> Pictures | None:
    if not paths:
        return None
    if len(paths) == 1 and is_video(paths[0]):
        return VideoPictures([VideoReader(paths[0])])
    return FilePictures([paths])
