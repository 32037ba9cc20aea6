"""Reads masks, which select the pixels of each camera in which features may be detected."""

from pathlib import Path

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.features import Mask
from quarc_ref.calibration.recordings import Recordings
from quarc_ref.datasets.arrangements import list_single_pictures
from quarc_ref.datasets.errors import MaskNameError, MaskSizeError
from quarc_ref.datasets.masks import describe_unused_masks, find_used_pixels
from quarc_ref.datasets.stills import read_still


def read_masks(folder: Path, recordings: Recordings) -> dict[str, Mask]:
    """Read the masks in a folder, and return them by camera name.

    Args:
        folder: Folder with one picture per masked camera. Each picture is named after its camera,
            and has the size of the camera's recording. Features at black pixels are not used.
        recordings: Recordings of the cameras.

    Raises:
        CalibrationError: The folder contains no masks, or a mask is entirely black.
        MaskNameError: A mask is not named after a camera.
        MaskSizeError: A mask and the recording of its camera differ in size.
        CaptureError: A mask cannot be read.
    """
    masks: dict[str, Mask] = {}
    paths_by_name = list_single_pictures(folder)
    unknown_names = sorted(paths_by_name.keys() - set(recordings.names))
    if unknown_names:
        raise MaskNameError(describe_unused_masks(folder, unknown_names, recordings.names))
    for name, (path, *_) in paths_by_name.items():
        masks[name] = find_used_pixels(read_still(path), path)
        height, width = masks[name].shape
        size = recordings.pictures.sizes[recordings.index(name)]
        if (width, height) != size:
            message = (
                f"mask {path} is {width}x{height}, but the pictures of its camera are "
                f"{size[0]}x{size[1]}"
            )
            raise MaskSizeError(message)
        if not masks[name].any():
            message = f"{path} is entirely black: it excludes all pixels of camera {name}"
            raise CalibrationError(message)
    if not masks:
        message = f"{folder} has no masks: add files such as {recordings.names[0]}.png"
        raise CalibrationError(message)
    return masks
