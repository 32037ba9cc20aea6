"""Checks whether matches between pictures lie on the epipolar lines of the poses.

Matches are found without the poses, so they give the error of a pose in pixels, even
errors too small to show in the colors. Repeated patterns can mislead single pairs of
cameras with very different directions, so neighbors are compared, and a camera is
reported if most of its pairs contradict its pose. The worst camera is removed before the
next one is judged.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.matches import find_features, match_features
from quarc_ref.format.cameras import Camera

_NEAREST = 4
_MAX_DEGREES = 20.0  # degrees between the axes of cameras whose matches are reliable
_FEW_DEGREES = 50.0  # degrees, if a camera has no neighbor within the limit above
_MIN_PIXELS = 1.5
_MIN_SHARE = 0.003  # relative to the width of a picture
_WIDEST = 1000  # maximum number of pixels of the pictures in which features are detected

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Pair:
    """Indices of two cameras with matches, and the error of the matches in pixels."""

    first: int
    second: int
    degrees: float
    error: float


def find_wrong_poses(capture: Capture) -> Iterator[Finding]:
    """Yield a finding for each camera whose pose does not fit the matches of frame 0.

    Args:
        capture: The capture; all its cameras are checked.

    Raises:
        CaptureError: A picture cannot be read.
    """
    pairs = _measure_pairs(capture)
    while pairs:
        errors = _judge(pairs, len(capture.cameras))
        limits = np.array([max(_MIN_PIXELS, _MIN_SHARE * c.width) for c in capture.cameras])
        worst = int(np.argmax(errors / limits))
        if errors[worst] <= limits[worst]:
            return
        name = capture.cameras[worst].name
        message = (
            f"the pose of {name} is off by {errors[worst]:.1f} pixels, measured by matches "
            f"with its neighbors (it should be at most {limits[worst]:.1f}): calibrate the "
            "camera again, or check that lens and picture match"
        )
        yield Finding("epipolar-error", message, (name,))
        pairs = [pair for pair in pairs if worst not in (pair.first, pair.second)]


def _judge(pairs: Sequence[_Pair], count: int) -> Numbers:
    """Return the `[camera]` lower median of the errors of each camera's pairs in pixels, or 0.

    Pairs with very different viewing directions are used only if a camera has no others;
    then the smallest of their errors is returned.
    """
    errors = np.zeros(count)
    for camera in range(count):
        own = [pair for pair in pairs if camera in (pair.first, pair.second)]
        near = sorted(pair.error for pair in own if pair.degrees <= _MAX_DEGREES)
        if near:
            errors[camera] = near[(len(near) - 1) // 2]
        elif own:
            errors[camera] = min(pair.error for pair in own)
    return errors


def _measure_pairs(capture: Capture) -> list[_Pair]:
    cameras = capture.cameras
    factors = [-(-camera.width // _WIDEST) for camera in cameras]
    features = [
        find_features(_shrink(capture.image(index, 0), factor))
        for index, factor in enumerate(factors)
    ]
    pairs = []
    for first, second, degrees in _choose_pairs(cameras):
        ours, theirs = match_features(features[first], features[second])
        if len(ours):
            distances = _measure_distances(
                ours * factors[first], theirs * factors[second], cameras[first], cameras[second]
            )
            pairs.append(_Pair(first, second, degrees, float(np.median(distances))))
    return pairs


def _shrink(picture: Image, factor: int) -> Image:
    """Downscale a picture by averaging squares of `factor` pixels."""
    if factor == 1:
        return picture
    height, width = (side // factor * factor for side in picture.shape[:2])
    cut = picture[:height, :width].reshape(height // factor, factor, width // factor, factor, 3)
    means: Image = cut.mean(axis=(1, 3)).astype(np.uint8)
    return means


def _choose_pairs(cameras: Sequence[Camera]) -> list[tuple[int, int, float]]:
    """Return each camera's nearest cameras with similar directions, and the angles in degrees."""
    centers = np.stack([camera_center(camera) for camera in cameras])
    axes = np.stack([np.array(camera.rotation).reshape(3, 3)[2] for camera in cameras])
    degrees = np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1)))
    chosen = set()
    for index in range(len(cameras)):
        distances = np.linalg.norm(centers - centers[index], axis=1)
        distances[degrees[index] > _FEW_DEGREES] = np.inf
        distances[index] = np.inf
        for other in np.argsort(distances)[:_NEAREST]:
            if np.isfinite(distances[other]):
                chosen.add((min(index, int(other)), max(index, int(other))))
    return [(first, second, float(degrees[first, second])) for first, second in sorted(chosen)]


def _measure_distances(ours: Numbers, theirs: Numbers, first: Camera, second: Camera) -> Numbers:
    """Return the `[m]` mean distances of matches from their epipolar lines in both pictures."""
    fundamental = _estimate_fundamental(first, second)
    ours, theirs = (np.column_stack([points, np.ones(len(points))]) for points in (ours, theirs))
    in_second, in_first = ours @ fundamental.T, theirs @ fundamental
    away = np.abs((theirs * in_second).sum(axis=1))
    tiny = 1e-12
    distances: Numbers = (
        away / np.maximum(np.hypot(in_second[:, 0], in_second[:, 1]), tiny)
        + away / np.maximum(np.hypot(in_first[:, 0], in_first[:, 1]), tiny)
    ) / 2
    return distances


def _estimate_fundamental(first: Camera, second: Camera) -> Numbers:
    """Return the `[3, 3]` fundamental matrix: pixels of the first to lines of the second camera."""
    turn, step = (
        [np.array(values).reshape(shape) for values in pair]
        for pair, shape in (
            ((first.rotation, second.rotation), (3, 3)),
            ((first.translation, second.translation), (3,)),
        )
    )
    rotation = turn[1] @ turn[0].T
    x, y, z = step[1] - rotation @ step[0]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    fundamental: Numbers = _invert(second).T @ cross @ rotation @ _invert(first)
    return fundamental


def _invert(camera: Camera) -> Numbers:
    """Return the `[3, 3]` matrix from pixels to directions."""
    return np.array(
        [
            [1 / camera.fx, 0, -camera.cx / camera.fx],
            [0, 1 / camera.fy, -camera.cy / camera.fy],
            [0, 0, 1],
        ]
    )
