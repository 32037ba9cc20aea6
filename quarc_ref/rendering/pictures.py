"""Renders decoded frames for evaluation and players; does not need torch."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.bands import render_band_pictures
from quarc_ref.rendering.harmonics import fold_harmonics
from quarc_ref.rendering.magnification import UNMAGNIFIED, Magnification
from quarc_ref.rendering.pipeline import project, sort_by_depth
from quarc_ref.rendering.pipeline_data import Float32, Picture, Projection, SplatRows

MAX_OPACITY = 0.99
SH_COEFFICIENT_COUNT = 4


def render_picture(
    splats: Splats, camera: Camera, magnification: Magnification = UNMAGNIFIED
) -> Float32:
    """Render the `[H, W, 3]` view of a camera on a black background.

    Args:
        splats: Splats of a frame; SH of other methods may have degrees up to 3.
        camera: The camera. Gaussians closer than a fixed fraction of the camera's near-plane
            distance are not rendered (SPEC 10.3).
        magnification: Size of the picture relative to the capture.
    """
    picture = np.empty((camera.height, camera.width, 3), dtype=np.float32)
    for band in render_bands(splats, camera, magnification):
        picture[band.top : band.top + band.image.shape[0]] = band.image
    return picture


def render_bands(
    splats: Splats, camera: Camera, magnification: Magnification = UNMAGNIFIED
) -> Iterator[Picture]:
    """Render a picture like `render_picture`, but in bands from top to bottom.

    Args:
        splats: Splats of a frame.
        camera: See `render_picture`.
        magnification: See `render_picture`.

    Yields:
        The rows of each band.
    """
    sorted_projection = _project(splats, camera, magnification)
    del splats  # releases memory; splats may use most of the memory
    yield from render_band_pictures(sorted_projection, camera)


def render_depth(
    splats: Splats, camera: Camera, magnification: Magnification = UNMAGNIFIED
) -> tuple[Float32, Float32]:
    """Render the depth and the opacity of a camera's view.

    Args:
        splats: See `render_picture`.
        camera: See `render_picture`.
        magnification: See `render_picture`.

    Returns:
        The `[H, W]` depth in world units along the optical axis, and the `[H, W]` accumulated
        opacity from 0 to 1. The depth of a pixel is the mean depth of its Gaussians,
        weighted like their colors; it is 0 for pixels without Gaussians.
    """
    sorted_projection = _project(splats, camera, magnification)
    depth_and_ones = np.zeros_like(sorted_projection.colors)
    depth_and_ones[:, 0], depth_and_ones[:, 1] = sorted_projection.depths, 1
    sums = np.empty((camera.height, camera.width, 3), dtype=np.float32)
    for band_picture in render_band_pictures(
        replace(sorted_projection, colors=depth_and_ones), camera
    ):
        sums[band_picture.top : band_picture.top + band_picture.image.shape[0]] = band_picture.image
    weighted_depth, opacity = sums[..., 0], np.ascontiguousarray(sums[..., 1])
    depth = np.divide(weighted_depth, opacity, out=np.zeros_like(opacity), where=opacity > 0)
    return depth, opacity


def _project(splats: Splats, camera: Camera, magnification: Magnification) -> Projection:
    """Project Gaussians to the picture plane; return the visible ones, sorted by depth."""
    with np.errstate(over="ignore"):  # non-finite Gaussians are not rendered
        opacities = np.minimum(1 / (1 + np.exp(-splats.opacities)), np.float32(MAX_OPACITY))
        scales = np.exp(splats.log_scales)
    sh = splats.sh
    if sh.shape[1] > SH_COEFFICIENT_COUNT:
        sh = fold_harmonics(sh, splats.positions, camera_center(camera))
    gaussians = SplatRows(splats.positions, splats.rotations, scales, opacities, sh)
    projection = project(camera, gaussians, magnification.max_low_pass)
    projection = magnification.filter(projection, splats.positions, camera)
    return projection.take(sort_by_depth(projection))
