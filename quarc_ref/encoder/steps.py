"""Chooses lattice and quantization steps from a capture's scale and resolution.

World units have no fixed meaning: a capture may be in meters or in arbitrary units of its
calibration. How visible a quantization error is depends on its size in pixels, and on the
sharpness of the pictures: a small shift is visible in sharp pictures, but not in blurred or
oversampled ones. The position step is therefore set in pixels, and the translation step by
the mean change of the pictures that a shift by one step causes. Both are rounded to whole
units of the lattice.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center, project_points
from quarc_ref.datasets.capture import Image, Points
from quarc_ref.encoder.settings.config import StepSettings
from quarc_ref.encoder.training.straight_through import position_step, translation_step
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader

_MIN_UNITS = 8
_MARGIN = 4
_MAX_PIXELS = 1.0
_WHITE = 255


def propose_steps(
    stream: StreamHeader,
    settings: StepSettings,
    cameras: Sequence[Camera],
    points: Points,
    pictures: Iterable[Image],
) -> StreamHeader:
    """Return a header with a lattice and steps that suit a capture.

    The lattice is chosen so that the smaller step is 8 to 16 lattice units, so rounding
    changes the steps by at most a sixteenth. A coarser lattice is used if this one does not
    cover 4 times the largest coordinate of cameras and points.

    Args:
        stream: Header settings; a step that is 0 in `settings` is taken from here.
        settings: Position step in pixels, and translation step as a change of the pictures.
        cameras: The training views.
        points: Initial points.
        pictures: Pictures `[H, W, 3]` of each view at frame 0.

    Raises:
        EncodeError: No view sees any point.
    """
    if not (settings.position_pixels or settings.translation_change):
        return stream
    pixel = measure_pixel(cameras, points)
    position = settings.position_pixels * pixel or position_step(stream)
    translation = translation_step(stream)
    if settings.translation_change:
        sharpness = max(measure_sharpness(pictures), settings.translation_change / _MAX_PIXELS)
        translation = settings.translation_change / sharpness * pixel
    exponent = _choose_exponent(min(position, translation), _measure_reach(cameras, points))
    return replace(
        stream,
        lattice_exponent=exponent,
        position_step=_count_units(position, exponent),
        translation_step=_count_units(translation, exponent),
    )


def measure_pixel(cameras: Sequence[Camera], points: Points) -> float:
    """Measure the width of a pixel at the scene's distance, in world units.

    The result is the median over the views of the median pixel width at the points that a
    view sees.

    Raises:
        EncodeError: No view sees any point.
    """
    widths = []
    for camera in cameras:
        projection = project_points(camera, points.positions)
        depths = projection.depths[projection.is_visible]
        if depths.size:
            widths.append(np.median(depths) / math.sqrt(camera.fx * camera.fy))
    if not widths:
        message = (
            "no training view sees an initial point: set the quantization steps in world units"
        )
        raise EncodeError(message)
    return float(np.median(widths))


def measure_sharpness(pictures: Iterable[Image]) -> float:
    """Measure the mean difference between neighboring pixels, as a fraction of white.

    The mean is over pixels, colors and both directions, after a 3x3 box filter that
    suppresses noise. All sums are integer sums, so the result is the same on every
    machine.

    Args:
        pictures: Pictures `[H, W, 3]`; those with a side below 4 pixels are ignored.
    """
    total = count = 0
    for picture in pictures:
        rows = picture[:-2].astype(np.int64) + picture[1:-1] + picture[2:]
        smooth = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]
        for axis in (0, 1):
            change = np.abs(np.diff(smooth, axis=axis))
            total, count = total + int(change.sum()), count + change.size
    return total / (9 * _WHITE * max(count, 1))


def _measure_reach(cameras: Sequence[Camera], points: Points) -> float:
    """Return the largest coordinate of cameras and points, in world units."""
    reach = float(np.abs(points.positions).max())
    for camera in cameras:
        reach = max(reach, float(np.abs(camera_center(camera)).max()))
    return reach


def _choose_exponent(step: float, reach: float) -> int:
    """Choose a lattice exponent that is fine enough for a step and covers a reach."""
    fine = math.ceil(math.log2(_MIN_UNITS / step))
    wide = math.floor(math.log2(POSITION_LIMIT / (_MARGIN * reach)))
    return min(max(min(fine, wide), 0), LATTICE_EXPONENT_LIMIT)


def _count_units(step: float, exponent: int) -> int:
    """Convert a step to lattice units."""
    return max(1, round(step * 2.0**exponent))
