"""Reads the masks of a capture, which select the pixels to use for training and evaluation.

White pixels are used and black pixels are ignored, as in COLMAP and nerfstudio. A camera has one
mask for all frames, one mask per frame, or no mask. Without a mask, all pixels are used.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import (
    Files,
    is_video,
    list_picture_folders,
    list_single_pictures,
    list_videos,
)
from quarc_ref.datasets.capture import Mask, MaskSource
from quarc_ref.datasets.errors import MaskCountError, MaskNameError, MaskSizeError
from quarc_ref.datasets.findings import Finding, list_names
from quarc_ref.datasets.pictures import FilePictures, Pictures, Size, VideoPictures
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.datasets.video import VideoReader

MASKS_NAME = "masks"
_LOSSLESS = ".png"
_HALF = 127  # of 255; lossy compression changes black and white slightly


class FileMasks:
    """Masks as stored on disk.

    Args:
        files: `[camera]` mask files: one file for all frames, one file per frame, or no file.
        sizes: `[camera]` width and height of the pictures, pixels.
        lengths: `[camera]` number of frames of the pictures.

    Attributes:
        paths: Mask files of all cameras.

    Raises:
        MaskSizeError: The first mask of a camera differs from its pictures in size.
        MaskCountError: A camera has several masks, but not one mask per frame.
        CaptureError: A mask cannot be read.
    """

    def __init__(
        self, files: Sequence[Sequence[Path]], sizes: Sequence[Size], lengths: Sequence[int]
    ) -> None:
        self.paths = tuple(path for row in files for path in row)
        self._sources = [_open(row) for row in files]
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
                    f"the camera of {path} has {count} masks, but {length} frames: a camera needs "
                    "one mask for all frames, or one mask per frame"
                )
                raise MaskCountError(message)

    def read(self, camera: int, frame: int) -> Mask | None:
        """Read a mask, as described for `MaskSource.read`."""
        source = self._sources[camera]
        if source is None:
            return None
        picture = source.read(0, frame if source.lengths[0] > 1 else 0)
        path = source.paths[0][min(frame, len(source.paths[0]) - 1)]
        least = 0 if path.suffix.lower() == _LOSSLESS else _HALF
        return np.asarray(picture.max(axis=2) > least)


class RectifiedMasks:
    """Masks that are undistorted, downscaled and synchronized like the pictures.

    Args:
        source: Masks of the pictures on disk.
        firsts: `[camera]` frame on disk that becomes frame 0.
        rectifiers: `[camera]` rectifiers of the pictures.
    """

    def __init__(
        self, source: MaskSource, firsts: Sequence[int], rectifiers: Sequence[Rectifier]
    ) -> None:
        self._source = source
        self._firsts = tuple(firsts)
        self._rectifiers = tuple(rectifiers)

    def read(self, camera: int, frame: int) -> Mask | None:
        """Read a mask, as described for `MaskSource.read`."""
        mask = self._source.read(camera, self._firsts[camera] + frame)
        return None if mask is None else self._rectifiers[camera].rectify_mask(mask)


def find_masks(
    folder: Path, names: Sequence[str]
) -> tuple[list[Sequence[Path]] | None, tuple[Finding, ...]]:
    """Find the masks of each camera in the folder `masks` of a capture.

    A mask is `NAME.png` for all frames of a camera, `NAME/0000.png` and so on for each frame, or a
    video `NAME.mp4`. COLMAP's masks `NAME.png.png`, named after the picture, are found as well.

    Args:
        folder: Folder of the capture.
        names: `[camera]` names of the cameras.

    Returns:
        `[camera]` mask files, or None if no camera has a mask; and a finding if some masks are not
        named after a camera.

    Raises:
        MaskNameError: The folder has masks, but none is named after a camera.
    """
    inside = folder / MASKS_NAME
    listed: list[Files] = [
        list_picture_folders(inside),
        list_videos(inside),
        {Path(name).stem: paths for name, paths in list_single_pictures(inside).items()},
        list_single_pictures(inside),
    ]
    found: Mapping[str, Sequence[Path]] = {
        name: paths for files in listed for name, paths in files.items()
    }
    rows = [found.get(name, ()) for name in names]
    used = {path for row in rows for path in row}
    unused = sorted(name for name, paths in found.items() if not used.issuperset(paths))
    if not unused:
        return rows if used else None, ()
    message = describe_unused_masks(inside, unused, names)
    if not used:
        raise MaskNameError(message)
    return rows, (Finding("mask-name", message),)


def describe_unused_masks(folder: Path, unused: Sequence[str], names: Sequence[str]) -> str:
    """Return an error message about masks that are not named after a camera.

    Args:
        folder: Folder of the masks.
        unused: Names of the masks that match no camera.
        names: Names of the cameras.
    """
    return (
        f"{folder} has masks named {list_names(unused)}, which match no camera: name masks "
        f"after the cameras ({list_names(names)}), such as {names[0]}.png"
    )


def _open(paths: Sequence[Path]) -> Pictures | None:
    if not paths:
        return None
    if len(paths) == 1 and is_video(paths[0]):
        return VideoPictures([VideoReader(paths[0])])
    return FilePictures([paths])
