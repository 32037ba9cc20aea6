"""Computes depth maps of posed pictures by plane sweep (Collins 1996; Yang and Pollefeys 2003).

The neighbors of a view are warped through planes at many depths, and compared with the view by
normalized cross-correlation of small windows. Each pixel gets the depth at which the mean
correlation with its two best neighbors is largest.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array
from quarc_ref.datasets.capture import Image

_MAX_SIDE = 320  # Maximum width or height of the compared pictures, pixels.
_PLANE_COUNT = 96  # Number of planes, at equal steps of inverse depth.
_WINDOW_SIZE = 7  # pixels
_MAX_NEIGHBORS = 4
# The two best neighbors determine a depth; in the others, the surface may be occluded.
_MIN_NEIGHBORS = 2
_MIN_ANGLE = 2.0  # Degrees; minimum angle between the viewing directions of neighbors.
_MAX_ANGLE = 60.0
_MIN_CORRELATION = 0.5
_NOISE_VARIANCE = 2e-6  # Approximate variance of the rounding error of gray levels from 0 to 1.
_OUTSIDE_GRAY = -10.0  # Gray level outside the picture, so that no window across the border fits.
_DEPTH_RANGE_QUANTILES = (0.01, 0.99)
_DEPTH_RANGE_FACTOR = 1.3

Gray = NDArray[np.float32]
Depths = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A downscaled picture and its camera.

    Attributes:
        picture: `[H, W, 3]` sRGB.
        gray: `[H, W]` gray levels from 0 to 1.
        matrix: `[3, 3]` intrinsic matrix; pixel centers are at whole numbers, as in cv2.
        rotation: `[3, 3]` rotation from world to camera.
        translation: `[3]` translation from world to camera, world units.
        inverse_depths: `[D]` inverse depths of the planes in ascending order, 1 / world units.
    """

    picture: Image
    gray: Gray
    matrix: Float64Array
    rotation: Float64Array
    translation: Float64Array
    inverse_depths: Float64Array

    def to_world(self, positions: Float64Array) -> Float64Array:
        """Convert camera coordinates `[P, 3]` to world coordinates `[P, 3]`."""
        world_positions: Float64Array = (positions - self.translation) @ self.rotation
        return world_positions


def make_view(camera: CalibratedCamera, picture: Image, depths: Float64Array) -> View:
    """Downscale the picture of a camera, and choose the depths of the planes.

    Args:
        camera: A pinhole camera.
        picture: `[H, W, 3]` sRGB.
        depths: `[V]` depths of points in the picture, at least one; the planes cover these depths.
    """
    lens = camera.lens
    scale = min(1.0, _MAX_SIDE / max(lens.width, lens.height))
    size = (max(1, round(lens.width * scale)), max(1, round(lens.height * scale)))
    x_scale, y_scale = size[0] / lens.width, size[1] / lens.height
    small_picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    gray = np.asarray(cv2.cvtColor(small_picture, cv2.COLOR_RGB2GRAY), np.float32) / np.float32(255)
    principal_point = (lens.cx * x_scale - 0.5, lens.cy * y_scale - 0.5)
    matrix = np.array(
        [
            [lens.fx * x_scale, 0, principal_point[0]],
            [0, lens.fy * y_scale, principal_point[1]],
            [0, 0, 1],
        ]
    )
    nearest, farthest = (
        float(np.quantile(depths, quantile)) for quantile in _DEPTH_RANGE_QUANTILES
    )
    inverse_depths = np.linspace(
        1 / (farthest * _DEPTH_RANGE_FACTOR), _DEPTH_RANGE_FACTOR / nearest, _PLANE_COUNT
    )
    return View(
        small_picture, gray, matrix, camera.pose.rotation, camera.pose.translation, inverse_depths
    )


def find_neighbors(views: Sequence[View], scene_center: Float64Array) -> list[list[int]]:
    """Return, for each view, the indices of the views with the most similar viewing directions.

    Args:
        views: All views.
        scene_center: `[3]` center of the scene, world units. A viewing direction points from the
            center of the scene to a camera.
    """
    candidates: list[list[tuple[float, int]]] = [[] for _ in views]
    directions = [view.to_world(np.zeros(3)) - scene_center for view in views]
    for first, second in combinations(range(len(views)), 2):
        cross_length = np.linalg.norm(np.cross(directions[first], directions[second]))
        angle = math.degrees(math.atan2(cross_length, directions[first] @ directions[second]))
        if _MIN_ANGLE <= angle <= _MAX_ANGLE:
            candidates[first].append((angle, second))
            candidates[second].append((angle, first))
    return [[index for _, index in sorted(neighbors)[:_MAX_NEIGHBORS]] for neighbors in candidates]


def find_depths(view: View, neighbors: Sequence[View]) -> Depths:
    """Return the `[H, W]` depth map of a view in world units; it is 0 where no depth fits.

    Args:
        view: View whose depths are computed.
        neighbors: Views to compare with `view`; with fewer than two neighbors, all depths are 0.
    """
    if len(neighbors) < _MIN_NEIGHBORS:
        return np.zeros(view.gray.shape, np.float32)
    mean, deviation = _measure_windows(view.gray)
    scores = np.empty((_PLANE_COUNT, *view.gray.shape), np.float32)
    for plane, inverse_depth in enumerate(view.inverse_depths):
        scores[plane] = average_best_two(
            _correlate_windows(
                view.gray, mean, deviation, _warp_neighbor(neighbor, view, inverse_depth)
            )
            for neighbor in neighbors
        )
    best_plane = scores[1:-1].argmax(axis=0) + 1
    score_before, best_score, score_after = (
        np.take_along_axis(scores, best_plane[None] + step, axis=0)[0] for step in (-1, 0, 1)
    )
    is_peak = (
        (best_score >= score_before) & (best_score >= score_after) & (best_score > _MIN_CORRELATION)
    )
    curvature = np.minimum(score_before - 2 * best_score + score_after, -1e-6)
    peak_position = best_plane + np.clip((score_before - score_after) / (2 * curvature), -0.5, 0.5)
    inverse_depth = np.interp(peak_position, np.arange(_PLANE_COUNT), view.inverse_depths)
    return np.where(is_peak, 1 / inverse_depth, 0).astype(np.float32)


def average_best_two(correlations: Iterable[Gray]) -> Gray:
    """Return the `[H, W]` mean of the two largest values of each pixel, without a slow sort.

    Args:
        correlations: Two or more `[H, W]` correlations.
    """
    first, other, *others = correlations
    best, second = np.maximum(first, other), np.minimum(first, other)
    for correlation in others:
        second = np.maximum(second, np.minimum(best, correlation))
        best = np.maximum(best, correlation)
    return np.asarray((second + best) / 2, np.float32)


def _warp_neighbor(neighbor: View, view: View, inverse_depth: float) -> Gray:
    """Warp a neighbor's gray levels into a view, through the plane at this inverse depth."""
    rotation = neighbor.rotation @ view.rotation.T
    translation = neighbor.translation - rotation @ view.translation
    homography = rotation + np.outer(translation, (0, 0, inverse_depth))
    warped = cv2.warpPerspective(
        neighbor.gray,
        neighbor.matrix @ homography @ np.linalg.inv(view.matrix),
        view.gray.shape[::-1],
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=_OUTSIDE_GRAY,
    )
    return np.asarray(warped, np.float32)


def _measure_windows(gray: Gray) -> tuple[Gray, Gray]:
    """Return the `[H, W]` mean and standard deviation of the window around each pixel."""
    mean = _average_window(gray)
    return mean, np.sqrt(
        np.maximum(_average_window(gray * gray) - mean * mean, 0) + _NOISE_VARIANCE
    )


def _correlate_windows(gray: Gray, mean: Gray, deviation: Gray, warped: Gray) -> Gray:
    """Return the `[H, W]` normalized cross-correlation of the windows around each pixel."""
    warped_mean, warped_deviation = _measure_windows(warped)
    covariance = _average_window(gray * warped) - mean * warped_mean
    correlation: Gray = covariance / (deviation * warped_deviation)
    return correlation


def _average_window(values: Gray) -> Gray:
    return np.asarray(cv2.blur(values, (_WINDOW_SIZE, _WINDOW_SIZE)), np.float32)
