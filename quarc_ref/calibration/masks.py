"""Masks of cameras: where in the pictures of a camera features may be."""

from pathlib import Path

import numpy as np

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.features import Mask
from quarc_ref.calibration.recordings import Recordings
from quarc_ref.datasets.arrangements import list_single_pictures
from quarc_ref.datasets.video import read_still


def read_masks(folder: Path, recordings: Recordings) -> dict[str, Mask]:
    """Return the masks in a folder, by the names of cameras.

    Args:
        folder: Folder with a picture per camera, named after it and of the size of its recording;
            black pixels are not searched for features. Cameras without one have no mask.
        recordings: Recordings of the cameras.

    Raises:
        CalibrationError: There is no mask, or one that is black all over.
        UnknownCameraError: A mask belongs to no camera.
        CaptureError: A mask cannot be read, or has another size.
    """
    masks: dict[str, Mask] = {}
    for name, (path, *_) in list_single_pictures(folder).items():
        size = recordings.pictures.sizes[recordings.index(name)]
        masks[name] = np.asarray(read_still(path, size).any(axis=2))
        if not masks[name].any():
            message = f"{path} is black all over, which leaves nothing of camera {name}"
            raise CalibrationError(message)
    if not masks:
        message = f"{folder} has no masks, such as {recordings.names[0]}.png"
        raise CalibrationError(message)
    return masks
