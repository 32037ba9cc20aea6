"""Checks poses by color: pixels should have the colors of the initial points they show.

The agreement of a picture and a pose is the correlation between the colors of visible points and
the pixels at their projections; it does not depend on exposure. Pictures are reported as mixed
up if they agree better with each other's poses than with their own. A pose is reported as wrong
if its agreement with its picture increases when the picture is shifted, or is much lower than the
agreement for other cameras.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.optimize import linear_sum_assignment

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.datasets.capture import Image
from quarc_ref.encoder.checks.visibility import find_visible_points
from quarc_ref.format.cameras import Camera

_MAX_POINTS = 1500
_MIN_POINTS = 50
# Relative to the width of a picture; the blur hides pose errors of a pixel.
_RELATIVE_BLUR_WIDTH = 1 / 80
_MIN_BLUR_PIXELS = 5
_MIN_COLOR_DEVIATION = 2.0  # 0 to 255; points of nearly the same color are not informative
# Step relative to the width of a picture, and number of steps in each direction.
_SHIFT_STEP, _SHIFT_COUNT = 0.02, 6
_MIN_INSIDE_FRACTION = 0.5  # fraction of the points that must be inside the shifted picture
_MIN_SHIFT_GAIN = 0.05
_MIN_SWAP_GAIN = 0.02
_MIN_FRACTION_OF_MEDIAN_AGREEMENT = 0.6
_MIN_AGREEMENT = 0.15


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Indices of cameras whose pictures do not fit their poses.

    Attributes:
        mixed_up_pairs: Pairs `(camera, other)` for which the picture of `camera` fits the pose of
            `other`.
        wrong_cameras: Cameras whose picture fits neither their own pose nor another camera's.
    """

    mixed_up_pairs: tuple[tuple[int, int], ...]
    wrong_cameras: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _PointSample:
    """Points visible in a picture: `[n]` columns and rows from 0 to 1, and `[n, 3]` colors."""

    columns: NDArray[np.float64]
    rows: NDArray[np.float64]
    colors: NDArray[np.float64]


def compare_colors(
    cameras: Sequence[Camera],
    projections: Sequence[PointProjection],
    colors: NDArray[np.uint8],
    pictures: Iterator[Image],
) -> Disagreement:
    """Find pictures that do not fit their poses.

    Args:
        cameras: Cameras, at least two.
        projections: Projection of the points into each camera.
        colors: `[P, 3]` sRGB colors of the points.
        pictures: `[H, W, 3]` sRGB picture of each camera.

    Returns:
        The faulty cameras. A camera is not reported if it sees too few points, or if all
        points that it sees have nearly the same color.
    """
    samples = [
        _sample_points(*camera_and_projection, colors)
        for camera_and_projection in zip(cameras, projections, strict=True)
    ]
    blurred_pictures = [_blur(picture) for picture in pictures]
    views = [view for view, sample in enumerate(samples) if _is_informative(sample)]
    agreements = np.array(
        [
            [_measure_agreement(blurred_pictures[view], samples[pose]) for pose in views]
            for view in views
        ]
    ).reshape(len(views), len(views))
    poses = _assign_poses(agreements)
    assigned_agreements = agreements[np.arange(len(views)), poses]
    min_agreement = (
        max(
            _MIN_AGREEMENT,
            _MIN_FRACTION_OF_MEDIAN_AGREEMENT * float(np.median(assigned_agreements)),
        )
        if views
        else 0.0
    )
    mixed_up_pairs, wrong_cameras = [], []
    for view, pose_index, agreement in zip(views, poses, assigned_agreements, strict=True):
        if views[pose_index] != view:
            mixed_up_pairs.append((view, views[pose_index]))
        elif agreement < min_agreement or _fits_better_shifted(
            blurred_pictures[view], samples[view], agreement
        ):
            wrong_cameras.append(view)
    return Disagreement(tuple(mixed_up_pairs), tuple(wrong_cameras))


def _assign_poses(agreements: NDArray[np.float64]) -> NDArray[np.intp]:
    """Assign a pose to each picture.

    Two or more pictures exchange poses only if the exchange improves the agreement of each of them.

    Args:
        agreements: `[n, n]` agreement of every picture with every pose.

    Returns:
        `[n]` index of the pose assigned to each picture.
    """
    own_poses = np.arange(len(agreements))
    poses = linear_sum_assignment(agreements, maximize=True)[1]
    assigned_agreements = agreements[own_poses, poses]
    is_better = (assigned_agreements > agreements[own_poses, own_poses] + _MIN_SWAP_GAIN) & (
        assigned_agreements >= _MIN_AGREEMENT
    )
    for _ in own_poses:  # rejects a permutation if one of its pictures does not improve
        is_better &= is_better[poses]
    return np.where(is_better, poses, own_poses)


def _sample_points(
    camera: Camera, projection: PointProjection, colors: NDArray[np.uint8]
) -> _PointSample:
    visible_indices = find_visible_points(camera, projection)[:_MAX_POINTS]
    return _PointSample(
        projection.columns[visible_indices] / camera.width,
        projection.rows[visible_indices] / camera.height,
        colors[visible_indices].astype(np.float64),
    )


def _is_informative(sample: _PointSample) -> bool:
    return (
        len(sample.colors) >= _MIN_POINTS and sample.colors.std(axis=0).max() > _MIN_COLOR_DEVIATION
    )


def _blur(picture: Image) -> Image:
    window_size = max(_MIN_BLUR_PIXELS, round(_RELATIVE_BLUR_WIDTH * picture.shape[1]))
    blurred: Image = uniform_filter(picture, size=(window_size, window_size, 1))
    return blurred


def _measure_agreement(
    picture: Image, sample: _PointSample, shift_x: float = 0.0, shift_y: float = 0.0
) -> float:
    """Return the correlation of point colors with the pixels of a shifted picture, -1 to 1.

    The result is 0 if more than half of the points are outside the picture, or if all points
    or all pixels have the same color.
    """
    height, width = picture.shape[:2]
    columns = np.floor((sample.columns + shift_x) * width).astype(np.int64)
    rows = np.floor((sample.rows + shift_y) * height).astype(np.int64)
    is_inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    if is_inside.mean() < _MIN_INSIDE_FRACTION:
        return 0.0
    pixels = picture[rows[is_inside], columns[is_inside]].astype(np.float64)
    pixels -= pixels.mean(axis=0)
    colors = sample.colors[is_inside] - sample.colors[is_inside].mean(axis=0)
    norm = float(np.square(pixels).sum() * np.square(colors).sum()) ** 0.5
    return float((pixels * colors).sum()) / norm if norm else 0.0


def _fits_better_shifted(picture: Image, sample: _PointSample, agreement: float) -> bool:
    aspect = picture.shape[1] / picture.shape[0]
    shifts = [_SHIFT_STEP * step for step in range(-_SHIFT_COUNT, _SHIFT_COUNT + 1)]
    return any(
        _measure_agreement(picture, sample, shift_x, aspect * shift_y) > agreement + _MIN_SHIFT_GAIN
        for shift_x in shifts
        for shift_y in shifts
    )
