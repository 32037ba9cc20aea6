"""Computes depth maps of posed pictures by plane sweep (Collins 1996; Yang and Pollefeys 2003).

The neighbors of a view are warped through planes at many depths, and compared with the view by
normalized cross-correlation of small windows. Each pixel gets the depth at which its two best
neighbors have the largest mean correlation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import CalibratedCamera, Numbers
from quarc_ref.datasets.capture import Image

_LONGER_SIDE = 320  # Maximum width or height of the compared pictures, pixels.
_PLANES = 96  # Number of planes, at equal steps of inverse depth.
_WINDOW = 7  # pixels
_NEIGHBORS = 4
_FITTING = 2  # Number of neighbors that determine a depth; other neighbors may be occluded.
_MIN_ANGLE = 2.0  # Degrees; minimum angle between the viewing directions of neighbors.
_MAX_ANGLE = 60.0
_MIN_CORRELATION = 0.5
_NOISE = 2e-6  # Approximate variance of the rounding error of gray levels from 0 to 1.
_OUTSIDE = -10.0  # Gray level outside the picture, so that no window across the border fits.
_RANGE_QUANTILES = (0.01, 0.99)
_RANGE_MARGIN = 1.3

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
    matrix: Numbers
    rotation: Numbers
    translation: Numbers
    inverse_depths: Numbers

    def to_world(self, positions: Numbers) -> Numbers:
        """Convert camera coordinates `[P, 3]` to world coordinates `[P, 3]`."""
        world: Numbers = (positions - self.translation) @ self.rotation
        return world


def make_view(camera: CalibratedCamera, picture: Image, depths: Numbers) -> View:
    """Downscale the picture of a camera, and choose the planes of its view.

    Args:
        camera: A pinhole camera.
        picture: `[H, W, 3]` sRGB.
        depths: `[V]` depths of points in the picture, at least one; the planes cover these depths.
    """
    lens = camera.lens
    scale = min(1.0, _LONGER_SIDE / max(lens.width, lens.height))
    size = (max(1, round(lens.width * scale)), max(1, round(lens.height * scale)))
    across, down = size[0] / lens.width, size[1] / lens.height
    small = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    gray = np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY), np.float32) / np.float32(255)
    center = (lens.cx * across - 0.5, lens.cy * down - 0.5)
    matrix = np.array([[lens.fx * across, 0, center[0]], [0, lens.fy * down, center[1]], [0, 0, 1]])
    nearest, farthest = (float(np.quantile(depths, each)) for each in _RANGE_QUANTILES)
    inverse = np.linspace(1 / (farthest * _RANGE_MARGIN), _RANGE_MARGIN / nearest, _PLANES)
    return View(small, gray, matrix, camera.pose.rotation, camera.pose.translation, inverse)


def find_neighbors(views: Sequence[View], middle: Numbers) -> list[list[int]]:
    """Return, for each view, the indices of the views with the most similar viewing directions.

    Args:
        views: All views.
        middle: `[3]` center of the scene, world units. A viewing direction points from the center
            of the scene to a camera.
    """
    found: list[list[tuple[float, int]]] = [[] for _ in views]
    sights = [view.to_world(np.zeros(3)) - middle for view in views]
    for first, second in combinations(range(len(views)), 2):
        across = np.linalg.norm(np.cross(sights[first], sights[second]))
        angle = math.degrees(math.atan2(across, sights[first] @ sights[second]))
        if _MIN_ANGLE <= angle <= _MAX_ANGLE:
            found[first].append((angle, second))
            found[second].append((angle, first))
    return [[index for _, index in sorted(each)[:_NEIGHBORS]] for each in found]


def find_depths(view: View, neighbors: Sequence[View]) -> Depths:
    """Return the `[H, W]` depth map of a view in world units; 0 where no depth fits.

    Args:
        view: View whose depths are computed.
        neighbors: Views to compare with `view`; for fewer than two neighbors, all depths are 0.
    """
    if len(neighbors) < _FITTING:
        return np.zeros(view.gray.shape, np.float32)
    mean, deviation = _measure_windows(view.gray)
    scores = np.empty((_PLANES, *view.gray.shape), np.float32)
    for plane, inverse in enumerate(view.inverse_depths):
        fits = [
            _correlate(view.gray, mean, deviation, _warp(neighbor, view, inverse))
            for neighbor in neighbors
        ]
        scores[plane] = np.sort(fits, axis=0)[-_FITTING:].mean(axis=0)
    best = scores[1:-1].argmax(axis=0) + 1
    before, at, after = (
        np.take_along_axis(scores, best[None] + step, axis=0)[0] for step in (-1, 0, 1)
    )
    is_peak = (at >= before) & (at >= after) & (at > _MIN_CORRELATION)
    curvature = np.minimum(before - 2 * at + after, -1e-6)
    place = best + np.clip((before - after) / (2 * curvature), -0.5, 0.5)
    inverse = np.interp(place, np.arange(_PLANES), view.inverse_depths)
    return np.where(is_peak, 1 / inverse, 0).astype(np.float32)


def _warp(neighbor: View, view: View, inverse_depth: float) -> Gray:
    """Warp a neighbor's gray levels to a view through the plane at `1 / inverse_depth`."""
    rotation = neighbor.rotation @ view.rotation.T
    shift = neighbor.translation - rotation @ view.translation
    induced = rotation + np.outer(shift, (0, 0, inverse_depth))
    warped = cv2.warpPerspective(
        neighbor.gray,
        neighbor.matrix @ induced @ np.linalg.inv(view.matrix),
        view.gray.shape[::-1],
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=_OUTSIDE,
    )
    return np.asarray(warped, np.float32)


def _measure_windows(gray: Gray) -> tuple[Gray, Gray]:
    """Return `[H, W]` mean and standard deviation of the window around each pixel."""
    mean = _average(gray)
    return mean, np.sqrt(np.maximum(_average(gray * gray) - mean * mean, 0) + _NOISE)


def _correlate(gray: Gray, mean: Gray, deviation: Gray, other: Gray) -> Gray:
    """Return `[H, W]` normalized cross-correlation of the windows around each pixel."""
    other_mean, other_deviation = _measure_windows(other)
    covariance = _average(gray * other) - mean * other_mean
    correlation: Gray = covariance / (deviation * other_deviation)
    return correlation


def _average(values: Gray) -> Gray:
    return np.asarray(cv2.blur(values, (_WINDOW, _WINDOW)), np.float32)
