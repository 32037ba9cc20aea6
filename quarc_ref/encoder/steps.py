"""The lattice and the steps of a stream, from the capture's scale and resolution.

World units say nothing: a capture may be in meters or in whatever a calibration
left it in. What a step costs in quality shows in pixels, so that steps are asked
for in pixels, or in shares of the distance between Gaussians there, and put on a
lattice that is a little finer than they are. A scene of many Gaussians to a pixel
is sharp and shows a small motion; one of few is not, and does not.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.config import StepSettings
from quarc_ref.encoder.straight_through import position_step, translation_step
from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Camera, StreamHeader

_LEAST_UNITS = 8
_MARGIN = 4


def propose_steps(
    stream: StreamHeader,
    settings: StepSettings,
    cameras: Sequence[Camera],
    points: Points,
    gaussian_count: int,
) -> StreamHeader:
    """Return a header whose lattice and steps suit a capture.

    The smaller step is 8 to 16 lattice units, so that neither step is farther
    than a sixteenth from what was asked, unless the lattice must be coarser to
    reach 4 times as far as the cameras and points do.

    Args:
        stream: Its world-unit steps stand where the settings are 0.
        settings: Steps in pixels and in spacings.
        cameras: The training views.
        points: Initial points.
        gaussian_count: As many as the canonical scene may have.

    Raises:
        EncodeError: No view sees a point.
    """
    if not (settings.position_pixels or settings.translation_spacing):
        return stream
    pixel = measure_pixel(cameras, points)
    spacing = pixel * measure_spacing(cameras, gaussian_count)
    position = settings.position_pixels * pixel or position_step(stream)
    translation = settings.translation_spacing * spacing or translation_step(stream)
    exponent = _choose_exponent(min(position, translation), _measure_reach(cameras, points))
    return replace(
        stream,
        lattice_exponent=exponent,
        position_step=_count_units(position, exponent),
        translation_step=_count_units(translation, exponent),
    )


def measure_pixel(cameras: Sequence[Camera], points: Points) -> float:
    """Return how wide a pixel is at the scene, world units.

    It is the median over the points that a view sees, and the median of that
    over the views.

    Raises:
        EncodeError: No view sees a point.
    """
    widths = []
    for camera in cameras:
        depths = _seen_depths(camera, points)
        if depths.size:
            widths.append(np.median(depths) / math.sqrt(camera.fx * camera.fy))
    if not widths:
        message = "no training view sees an initial point: set the steps in world units"
        raise EncodeError(message)
    return float(np.median(widths))


def measure_spacing(cameras: Sequence[Camera], gaussian_count: int) -> float:
    """Return how far apart Gaussians are that are spread over a picture, pixels."""
    areas = [camera.width * camera.height for camera in cameras]
    return math.sqrt(float(np.median(areas)) / gaussian_count)


def _seen_depths(camera: Camera, points: Points) -> NDArray[np.float64]:
    """Return the depths of the points within a camera's picture, world units."""
    rotation = np.array(camera.rotation).reshape(3, 3)
    seen = points.positions.astype(np.float64) @ rotation.T + np.array(camera.translation)
    x, y, depth = seen[seen[:, 2] > 0].T
    column = camera.fx * x / depth + camera.cx
    row = camera.fy * y / depth + camera.cy
    within = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
    depths: NDArray[np.float64] = depth[within]
    return depths


def _measure_reach(cameras: Sequence[Camera], points: Points) -> float:
    """Return the largest coordinate of cameras and points, world units."""
    reach = float(np.abs(points.positions).max())
    for camera in cameras:
        rotation = np.array(camera.rotation).reshape(3, 3)
        reach = max(reach, float(np.abs(rotation.T @ np.array(camera.translation)).max()))
    return reach


def _choose_exponent(step: float, reach: float) -> int:
    """Return the exponent of the lattice: fine enough for a step, wide enough for a reach."""
    fine = math.ceil(math.log2(_LEAST_UNITS / step))
    wide = math.floor(math.log2(POSITION_LIMIT / (_MARGIN * reach)))
    return min(max(min(fine, wide), 0), LATTICE_EXPONENT_LIMIT)


def _count_units(step: float, exponent: int) -> int:
    """Return a step in lattice units."""
    return max(1, round(step * 2.0**exponent))
