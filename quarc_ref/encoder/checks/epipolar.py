"""Checks whether feature matches between pictures lie on the epipolar lines of the poses.

The matches do not depend on the poses, so they reveal even pose errors that are too small
for the color check. Errors are measured in pixels. Repeated patterns cause wrong matches
between cameras with very different viewing directions. Therefore, only neighboring cameras
are compared, and a camera is reported only if most of its pairs contradict its pose. After a
camera is reported, the remaining cameras are checked without it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.matches import can_find_features, find_features, match_features
from quarc_ref.format.cameras import Camera

_NEIGHBOR_COUNT = 4
_MAX_RELIABLE_DEGREES = 20.0  # largest angle between optical axes for reliable matches
_MAX_FALLBACK_DEGREES = 50.0  # largest angle if a camera has no neighbor within the limit above
_MAX_ERROR_PIXELS = 1.5
_MAX_ERROR_FRACTION = 0.003  # relative to the width of a picture
_MAX_FEATURE_WIDTH = 1000  # maximum width of the pictures in which features are detected

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _CameraPair:
    """A pair of cameras whose pictures share feature matches.

    Attributes:
        first: Index of the first camera.
        second: Index of the second camera.
        degrees: Angle between the optical axes, degrees.
        error: Median distance of the matches from their epipolar lines, pixels.
    """

    first: int
    second: int
    degrees: float
    error: float


def find_wrong_poses(capture: Capture) -> Iterator[Finding]:
    """Yield a finding for each camera whose pose contradicts the matches of frame 0.

    Without pycolmap, which detects the features, the only finding says that nothing was checked.

    Args:
        capture: The capture; all of its cameras are checked, including held-out cameras.

    Raises:
        CaptureError: A picture cannot be read.
    """
    if not can_find_features():
        message = "the poses were not compared with feature matches: pycolmap is not installed"
        yield Finding("epipolar-unchecked", message)
        return
    pairs = _measure_pairs(capture)
    while pairs:
        errors = _measure_camera_errors(pairs, len(capture.cameras))
        limits = np.array(
            [
                max(_MAX_ERROR_PIXELS, _MAX_ERROR_FRACTION * camera.width)
                for camera in capture.cameras
            ]
        )
        worst_camera = int(np.argmax(errors / limits))
        if errors[worst_camera] <= limits[worst_camera]:
            return
        name = capture.cameras[worst_camera].name
        message = (
            f"the pose of {name} is off by {errors[worst_camera]:.1f} pixels according to feature "
            f"matches with its neighbors (at most {limits[worst_camera]:.1f} pixels are expected): "
            "calibrate the camera again, or check that its intrinsics and picture match"
        )
        yield Finding("epipolar-error", message, (name,))
        pairs = [pair for pair in pairs if worst_camera not in (pair.first, pair.second)]


def _measure_camera_errors(pairs: Sequence[_CameraPair], camera_count: int) -> Numbers:
    """Return the `[camera]` pose error of each camera, in pixels.

    The error is the lower median over the camera's pairs with similar viewing directions. If the
    camera has no such pairs, its error is the smallest error of its other pairs, or 0 if it has
    no pairs.
    """
    errors = np.zeros(camera_count)
    for camera in range(camera_count):
        camera_pairs = [pair for pair in pairs if camera in (pair.first, pair.second)]
        reliable_errors = sorted(
            pair.error for pair in camera_pairs if pair.degrees <= _MAX_RELIABLE_DEGREES
        )
        if reliable_errors:
            errors[camera] = reliable_errors[(len(reliable_errors) - 1) // 2]
        elif camera_pairs:
            errors[camera] = min(pair.error for pair in camera_pairs)
    return errors


def _measure_pairs(capture: Capture) -> list[_CameraPair]:
    cameras = capture.cameras
    factors = [-(-camera.width // _MAX_FEATURE_WIDTH) for camera in cameras]
    features = [
        find_features(_downscale(capture.image(index, 0), factor))
        for index, factor in enumerate(factors)
    ]
    pairs = []
    for first, second, degrees in _choose_pairs(cameras):
        first_points, second_points = match_features(features[first], features[second])
        if len(first_points):
            distances = _measure_distances(
                first_points * factors[first],
                second_points * factors[second],
                cameras[first],
                cameras[second],
            )
            pairs.append(_CameraPair(first, second, degrees, float(np.median(distances))))
    return pairs


def _downscale(picture: Image, factor: int) -> Image:
    """Downscale a picture `[H, W, 3]` by averaging squares of `factor` x `factor` pixels."""
    if factor == 1:
        return picture
    height, width = (side // factor * factor for side in picture.shape[:2])
    squares = picture[:height, :width].reshape(height // factor, factor, width // factor, factor, 3)
    means: Image = squares.mean(axis=(1, 3)).astype(np.uint8)
    return means


def _choose_pairs(cameras: Sequence[Camera]) -> list[tuple[int, int, float]]:
    """Return `(first, second, degrees)` of neighboring cameras with similar viewing directions."""
    centers = np.stack([camera_center(camera) for camera in cameras])
    axes = np.stack([np.array(camera.rotation).reshape(3, 3)[2] for camera in cameras])
    degrees = np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1)))
    pairs = set()
    for index in range(len(cameras)):
        distances = np.linalg.norm(centers - centers[index], axis=1)
        distances[degrees[index] > _MAX_FALLBACK_DEGREES] = np.inf
        distances[index] = np.inf
        for neighbor in np.argsort(distances)[:_NEIGHBOR_COUNT]:
            if np.isfinite(distances[neighbor]):
                pairs.add((min(index, int(neighbor)), max(index, int(neighbor))))
    return [(first, second, float(degrees[first, second])) for first, second in sorted(pairs)]


def _measure_distances(
    first_points: Numbers, second_points: Numbers, first: Camera, second: Camera
) -> Numbers:
    """Return the `[m]` distances from matches to epipolar lines, averaged over both pictures."""
    fundamental = _estimate_fundamental(first, second)
    first_points, second_points = (
        np.column_stack([points, np.ones(len(points))]) for points in (first_points, second_points)
    )
    lines_in_second, lines_in_first = first_points @ fundamental.T, second_points @ fundamental
    algebraic_errors = np.abs((second_points * lines_in_second).sum(axis=1))
    min_norm = 1e-12
    distances: Numbers = (
        algebraic_errors
        / np.maximum(np.hypot(lines_in_second[:, 0], lines_in_second[:, 1]), min_norm)
        + algebraic_errors
        / np.maximum(np.hypot(lines_in_first[:, 0], lines_in_first[:, 1]), min_norm)
    ) / 2
    return distances


def _estimate_fundamental(first: Camera, second: Camera) -> Numbers:
    """Return the `[3, 3]` fundamental matrix that maps pixels of `first` to lines in `second`."""
    rotations, translations = (
        [np.array(values).reshape(shape) for values in pair]
        for pair, shape in (
            ((first.rotation, second.rotation), (3, 3)),
            ((first.translation, second.translation), (3,)),
        )
    )
    rotation = rotations[1] @ rotations[0].T
    x, y, z = translations[1] - rotation @ translations[0]
    cross_matrix = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    fundamental: Numbers = (
        _inverse_intrinsics(second).T @ cross_matrix @ rotation @ _inverse_intrinsics(first)
    )
    return fundamental


def _inverse_intrinsics(camera: Camera) -> Numbers:
    """Return the `[3, 3]` matrix that maps homogeneous pixels to directions in camera space."""
    return np.array(
        [
            [1 / camera.fx, 0, -camera.cx / camera.fx],
            [0, 1 / camera.fy, -camera.cy / camera.fy],
            [0, 0, 1],
        ]
    )
