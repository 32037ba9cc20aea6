"""Checks poses by color: pictures should show initial points in their colors.

The agreement of a picture and a pose is the correlation between the colors of visible
points and the pixels at their projections; it does not depend on exposure. Three faults
are detected: pictures that agree better with each other's poses are mixed up; a picture
that agrees better after a shift, or much less than the others, has a wrong pose.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.optimize import linear_sum_assignment

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.datasets.capture import Image
from quarc_ref.encoder.checks.visibility import drop_hidden
from quarc_ref.format.cameras import Camera

_MAX_POINTS = 1500
_MIN_POINTS = 50
_BLUR = 1 / 80  # relative to the width of a picture, so that pose errors of a pixel do not matter
_MIN_BLUR = 5
_MIN_SPREAD = 2.0  # minimum deviation of colors, of 255: uniform color is not informative
# step relative to the width of a picture, and number of steps in each direction
_SHIFT, _SHIFTS = 0.02, 6
_MIN_LEFT = 0.5  # minimum share of the points that remain in the shifted picture
_BETTER_SHIFTED = 0.05
_BETTER_ELSEWHERE = 0.02
_FAR_BELOW_OTHERS = 0.6
_MIN_AGREEMENT = 0.15


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Indices of cameras whose pictures do not fit their poses.

    Attributes:
        mixed_up: Pairs of a picture and a fitting pose of another camera.
        wrong: Cameras whose picture fits no pose.
    """

    mixed_up: tuple[tuple[int, int], ...]
    wrong: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """Prediction of a pose: `[n]` columns and rows relative to the picture, `[n, 3]` colors."""

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
        colors: `[P, 3]` sRGB of the points.
        pictures: `[H, W, 3]` sRGB, one per camera.

    Returns:
        The faulty cameras. Cameras that see too few points are not reported, and none are
        if all points have the same color.
    """
    samples = [_sample(*of_view, colors) for of_view in zip(cameras, projections, strict=True)]
    blurred = [_blur(picture) for picture in pictures]
    judged = [view for view, sample in enumerate(samples) if _is_informative(sample)]
    fits = np.array(
        [[_agree(blurred[view], samples[pose]) for pose in judged] for view in judged]
    ).reshape(len(judged), len(judged))
    poses = _assign_poses(fits)
    best = fits[np.arange(len(judged)), poses]
    least = max(_MIN_AGREEMENT, _FAR_BELOW_OTHERS * float(np.median(best))) if judged else 0.0
    mixed_up, wrong = [], []
    for view, place, fit in zip(judged, poses, best, strict=True):
        if judged[place] != view:
            mixed_up.append((view, judged[place]))
        elif fit < least or _fits_better_shifted(blurred[view], samples[view], fit):
            wrong.append(view)
    return Disagreement(tuple(mixed_up), tuple(wrong))


def _assign_poses(fits: NDArray[np.float64]) -> NDArray[np.intp]:
    """Assign a pose to each picture: its own, unless a permutation improves all pictures involved.

    Args:
        fits: `[n, n]` agreement of every picture with every pose.
    """
    own = np.arange(len(fits))
    poses = linear_sum_assignment(fits, maximize=True)[1]
    best = fits[own, poses]
    gains = (best > fits[own, own] + _BETTER_ELSEWHERE) & (best >= _MIN_AGREEMENT)
    for _ in own:  # rejects a permutation if any of its pictures does not improve
        gains &= gains[poses]
    return np.where(gains, poses, own)


def _sample(camera: Camera, projection: PointProjection, colors: NDArray[np.uint8]) -> _Sample:
    shown = drop_hidden(camera, projection)[:_MAX_POINTS]
    return _Sample(
        projection.columns[shown] / camera.width,
        projection.rows[shown] / camera.height,
        colors[shown].astype(np.float64),
    )


def _is_informative(sample: _Sample) -> bool:
    return len(sample.colors) >= _MIN_POINTS and sample.colors.std(axis=0).max() > _MIN_SPREAD


def _blur(picture: Image) -> Image:
    side = max(_MIN_BLUR, round(_BLUR * picture.shape[1]))
    blurred: Image = uniform_filter(picture, size=(side, side, 1))
    return blurred


def _agree(picture: Image, sample: _Sample, across: float = 0.0, down: float = 0.0) -> float:
    """Return the correlation of points with the pixels of a shifted picture, from -1 to 1.

    It is 0 if half of the points are outside the picture, or a picture has a single color.
    """
    height, width = picture.shape[:2]
    columns = np.floor((sample.columns + across) * width).astype(np.int64)
    rows = np.floor((sample.rows + down) * height).astype(np.int64)
    left = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    if left.mean() < _MIN_LEFT:
        return 0.0
    pixels = picture[rows[left], columns[left]].astype(np.float64)
    pixels -= pixels.mean(axis=0)
    colors = sample.colors[left] - sample.colors[left].mean(axis=0)
    size = float(np.square(pixels).sum() * np.square(colors).sum()) ** 0.5
    return float((pixels * colors).sum()) / size if size else 0.0


def _fits_better_shifted(picture: Image, sample: _Sample, fit: float) -> bool:
    aspect = picture.shape[1] / picture.shape[0]
    steps = [_SHIFT * step for step in range(-_SHIFTS, _SHIFTS + 1)]
    return any(
        _agree(picture, sample, across, aspect * down) > fit + _BETTER_SHIFTED
        for across in steps
        for down in steps
    )
