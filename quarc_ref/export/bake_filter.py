"""Adds the low-pass filter of the capture's pictures to Gaussians, for other viewers.

A viewer adds 0.3 pixels of its own picture to every Gaussian. On a screen of much higher resolution
than the capture, thin Gaussians therefore become lines with gaps between them. quarc-ref's player
scales the filter instead (SPEC 10.3).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from quarc_ref.datasets.camera_geometry import project_points
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LOW_PASS


def bake_filter(splats: Splats, cameras: Sequence[Camera]) -> Splats:
    """Return splats whose scales include the low-pass filter.

    The filter of a Gaussian is that of the camera in whose picture the Gaussian is largest.
    Gaussians outside all pictures get the median filter.

    Args:
        splats: Splats of a frame.
        cameras: Cameras of the capture, at least one.
    """
    pixel_sizes = np.full(len(splats.positions), np.inf)  # world units
    for camera in cameras:
        projection = project_points(camera, splats.positions)
        sizes = projection.depths / np.sqrt(camera.fx * camera.fy)
        pixel_sizes = np.where(projection.is_visible, np.minimum(pixel_sizes, sizes), pixel_sizes)
    is_visible = np.isfinite(pixel_sizes)
    if not is_visible.any():
        return splats
    pixel_sizes[~is_visible] = np.median(pixel_sizes[is_visible])
    log_filter = np.log(np.sqrt(LOW_PASS) * pixel_sizes)[:, None]
    log_scales = np.logaddexp(2 * splats.log_scales, 2 * log_filter) / 2
    return replace(splats, log_scales=log_scales.astype(np.float32))
