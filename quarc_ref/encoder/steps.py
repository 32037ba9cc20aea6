"""Chooses the lattice and quantization steps from a capture's scale and resolution.

World units have no fixed size: a capture may use meters or the arbitrary units of its
calibration. The visibility of a quantization error depends on its size in pixels and on the
sharpness of the pictures: a small shift is visible in sharp pictures, but not in blurred or
oversampled pictures. The position step is therefore specified in pixels. The translation step
is specified as the root-mean-square change of the pictures that a shift by one step causes. Before
frame 0 is trained, this change is a fraction of white; afterwards, it is relative to the error of
frame 0. Both steps are rounded to multiples of the lattice unit.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center, project_points
from quarc_ref.datasets.capture import Image, Mask, Points
from quarc_ref.encoder.settings.config import StepSettings
from quarc_ref.encoder.training.straight_through import position_step, translation_step
from quarc_ref.format.arrays import Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import LATTICE_STEP_LIMIT, StreamHeader

_MIN_UNITS_PER_STEP = 8
_MIN_STEP_SIZE = 2.0**-LATTICE_EXPONENT_LIMIT / 2  # world units
_RANGE_FACTOR = 4  # range of the lattice, relative to the reach of cameras and points
_REACH_QUANTILE = 0.99
_MIN_TRANSLATION_PIXELS, _MAX_TRANSLATION_PIXELS = 0.02, 1.0
_WHITE = 255
_BOX_SIZE = 9  # pixels
_NEIGHBORS = (np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])

MaskedPicture = tuple[Image, Mask | None]  # `[H, W, 3]` and `[H, W]`; None: all pixels are used


def propose_steps(
    header: StreamHeader,
    settings: StepSettings,
    cameras: Sequence[Camera],
    points: Points,
    pictures: Iterable[MaskedPicture],
) -> StreamHeader:
    """Return a header with a lattice and steps that suit a capture.

    The smaller step is 8 to 16 lattice units, so that rounding changes the steps by at most a
    sixteenth. With `translation_error`, this also holds for the smallest translation step that can
    be chosen later. If a lattice this fine does not cover four times the coordinates of cameras and
    points (`measure_reach`), a coarser lattice is used.

    Args:
        header: Header from the settings. If a step is 0 in `settings`, the step in `header` is
            kept.
        settings: Position step in pixels, and translation step as a change of the pictures.
        cameras: The training cameras.
        points: Initial points.
        pictures: Picture of each training camera at frame 0.

    Raises:
        EncodeError: No initial point is visible in a training view, or the format does not support
            the steps.
    """
    if settings == StepSettings():
        return header
    pixel_size = measure_pixel_size(cameras, points)
    position_step_size = settings.position_pixels * pixel_size or position_step(header)
    translation_step_size = translation_step(header)
    if settings.translation_change:
        sharpness = measure_sharpness(pictures)
        translation_step_size = pixel_size * _translation_pixels(
            settings.translation_change, sharpness
        )
    step_sizes = position_step_size, translation_step_size
    finest_step_size = min(step_sizes)
    if settings.translation_error:
        finest_step_size = min(finest_step_size, _MIN_TRANSLATION_PIXELS * pixel_size)
    try:
        if min(step_sizes) < _MIN_STEP_SIZE:
            message = "a step is smaller than half a unit of the finest lattice"
            raise ValueError(message)  # noqa: TRY301, reported with the errors of the header
        exponent = _choose_exponent(finest_step_size, measure_reach(cameras, points))
        position_units, translation_units = (_to_lattice_units(x, exponent) for x in step_sizes)
        return replace(
            header,
            lattice_exponent=exponent,
            position_step=position_units,
            translation_step=translation_units,
        )
    except (OverflowError, ValueError) as error:
        message = (
            f"the format does not support a position step of {position_step_size:.3g} with a "
            f"translation step of {translation_step_size:.3g} world units: change "
            "steps.position_pixels or steps.translation_change, or scale the capture"
        )
        raise EncodeError(message) from error


def replace_translation_step(
    header: StreamHeader,
    change: float,
    cameras: Sequence[Camera],
    points: Points,
    pictures: Iterable[MaskedPicture],
) -> StreamHeader:
    """Return a header with a translation step that causes a given change of the pictures.

    If the format does not support a step as large as this, the largest step is used.

    Args:
        header: Header from `propose_steps`, whose lattice is kept.
        change: Root-mean-square change of the pictures, as a fraction of white.
        cameras: The training cameras.
        points: Initial points.
        pictures: Picture of each training camera at frame 0.

    Raises:
        EncodeError: No initial point is visible in a training view.
    """
    pixels = _translation_pixels(change, measure_sharpness(pictures))
    step_size = pixels * measure_pixel_size(cameras, points)
    step_units = _to_lattice_units(step_size, header.lattice_exponent)
    return replace(header, translation_step=min(step_units, LATTICE_STEP_LIMIT))


def measure_pixel_size(cameras: Sequence[Camera], points: Points) -> float:
    """Measure the width of a pixel at the scene's distance, in world units.

    The pixel width of a camera is measured at the median depth of the points that it sees. The
    result is the median over the cameras.

    Raises:
        EncodeError: No point is visible in a camera.
    """
    widths = []
    for camera in cameras:
        projection = project_points(camera, points.positions)
        depths = projection.depths[projection.is_visible]
        if depths.size:
            widths.append(np.median(depths) / math.sqrt(camera.fx * camera.fy))
    if not widths:
        message = (
            "no initial point is visible in a training view, so the size of a pixel in world units "
            "is unknown: check poses and points, or set steps.position_pixels and "
            "steps.translation_change to 0"
        )
        raise EncodeError(message)
    return float(np.median(widths))


def measure_sharpness(pictures: Iterable[MaskedPicture]) -> float:
    """Measure the root-mean-square difference between neighboring pixels, as a fraction of white.

    The mean is taken over all pixels, all color channels and both axes, after a 3x3 box filter has
    suppressed noise. Differences that depend on masked pixels are not counted. Squares give edges
    more weight than a mean of magnitudes would, so that large plain areas, such as a dark
    background, reduce the result less. All sums are integers, so the result is the same on every
    machine.

    Args:
        pictures: Pictures; those with a side shorter than 3 pixels are ignored.
    """
    square_sum = difference_count = 0
    for picture, mask in pictures:
        box_sums = _sum_boxes(picture.astype(np.int64))
        is_used = None if mask is None else _sum_boxes(mask.astype(np.int64)) == _BOX_SIZE
        for first, second in _NEIGHBORS:
            differences = box_sums[second] - box_sums[first]
            if is_used is not None:
                differences = differences[is_used[first] & is_used[second]]
            square_sum += int(np.square(differences).sum())
            difference_count += differences.size
    return math.sqrt(square_sum / max(difference_count, 1)) / (_BOX_SIZE * _WHITE)


def _sum_boxes(values: Int64) -> Int64:
    """Return the sums of all squares of 3x3 pixels, whose centers are not at the edge."""
    row_sums = values[:-2] + values[1:-1] + values[2:]
    box_sums: Int64 = row_sums[:, :-2] + row_sums[:, 1:-1] + row_sums[:, 2:]
    return box_sums


def _translation_pixels(change: float, sharpness: float) -> float:
    """Return the shift in pixels that changes pictures of a sharpness by a given amount."""
    if change >= _MAX_TRANSLATION_PIXELS * sharpness:  # also if both are 0
        return _MAX_TRANSLATION_PIXELS
    return max(change / sharpness, _MIN_TRANSLATION_PIXELS)


def measure_reach(cameras: Sequence[Camera], points: Points) -> float:
    """Measure how far cameras and points are from the origin along an axis, in world units.

    The farthest hundredth of the points is ignored, because a wrong point can be at any distance.
    """
    distances = np.abs(points.positions).max(axis=1)
    reach = float(np.quantile(distances, _REACH_QUANTILE, method="higher"))
    return max(reach, *(float(np.abs(camera_center(camera)).max()) for camera in cameras))


def _choose_exponent(step: float, reach: float) -> int:
    """Choose the lattice exponent for a step and the reach of the scene, both in world units."""
    precision_exponent = math.ceil(math.log2(_MIN_UNITS_PER_STEP / step))
    range_exponent = math.floor(math.log2(POSITION_LIMIT / (_RANGE_FACTOR * reach)))
    return min(max(min(precision_exponent, range_exponent), 0), LATTICE_EXPONENT_LIMIT)


def _to_lattice_units(step: float, exponent: int) -> int:
    """Convert a step in world units to lattice units, at least 1."""
    return max(1, round(step * 2.0**exponent))
