"""Chooses the initial points of a capture: given, triangulated, or those of the subject."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from quarc_ref.datasets.calibration import CalibratedCamera, make_camera
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.capture_media import CaptureMedia
from quarc_ref.datasets.point_cache import load_or_compute_points
from quarc_ref.datasets.subject_points import choose_subject_points
from quarc_ref.datasets.triangulation import triangulate


def choose_points(
    points: Points | None,
    cameras: Sequence[CalibratedCamera],
    training: Sequence[int],
    media: CaptureMedia,
    cache_key: str,
) -> Points:
    """Return the initial points of a capture.

    Args:
        points: Given points; None if there are none.
        cameras: All cameras, with pinhole lenses.
        training: Indices of the training cameras, whose pictures at frame 0 may be read.
        media: Pictures of all cameras.
        cache_key: Key of triangulated points in the cache.

    Raises:
        UnreadablePointsError: Too few points can be found.
        CaptureError: A picture cannot be read.
    """
    training_cameras = [cameras[index] for index in training]
    if media.alphas is not None:
        # Near planes may need points, but projections need no near planes.
        pinholes = [
            make_camera(replace(camera, near=1.0), np.zeros((0, 3))) for camera in training_cameras
        ]
        alphas = [media.alphas.read(index, 0) for index in training]
        return choose_subject_points(
            points, pinholes, alphas, lambda position: media.pictures.read(training[position], 0)
        )
    if points is not None:
        return points
    return load_or_compute_points(
        cache_key,
        lambda: triangulate(training_cameras, [media.pictures.read(i, 0) for i in training]),
    )
