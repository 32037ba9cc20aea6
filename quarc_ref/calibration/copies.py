"""Rejects recordings that are copies of each other.

A copy would confirm every wrong point of its original, and pass as a camera in the same place.
"""

import numpy as np

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.recordings import Recordings
from quarc_ref.encoder.checks.equal_pictures import (
    find_equal_pictures,
    is_blank,
    make_thumbnail,
)


def require_distinct_recordings(recordings: Recordings) -> None:
    """Check that no two recordings begin with the same picture.

    Raises:
        CalibrationError: Two recordings begin with the same picture.
        CaptureError: A picture cannot be read.
    """
    thumbnails = {}
    for camera, name in enumerate(recordings.names):
        picture = recordings.pictures.read(camera, 0)
        thumbnail = make_thumbnail(picture.astype(np.float32).mean(axis=2))
        if not is_blank(thumbnail):
            thumbnails[name] = thumbnail
    for finding in find_equal_pictures([*thumbnails], [*thumbnails.values()]):
        raise CalibrationError(finding.message)
