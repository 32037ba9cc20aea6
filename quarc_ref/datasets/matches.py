"""Detects SIFT features with pycolmap, and matches the features of two pictures.

Matching does not use the camera poses, so the matches can be used to check the poses.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import Float64Array
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.colmap_cameras import silence_colmap
from quarc_ref.datasets.colmap_import import IS_INSTALLED, pycolmap

_MAX_FEATURES = 2000
_DESCRIPTOR_SIZE = 128  # Dimension of a descriptor.
_MAX_DISTANCE_RATIO = 0.8  # Largest ratio of distances that passes Lowe's test.
_MIN_MATCHES = 16
_MAX_EPIPOLAR_DISTANCE = 1.5  # pixels: maximum distance of an inlier from its epipolar line
_LUMA_WEIGHTS = np.array([0.299, 0.587, 0.114], dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """SIFT features of a picture.

    Attributes:
        positions: `[n, 2]` positions in pixels, with pixel centers at +0.5.
        descriptors: `[n, 128]` SIFT descriptors, normalized to unit length.
    """

    positions: Float64Array
    descriptors: NDArray[np.float32]


def can_find_features() -> bool:
    """Return whether pycolmap, which detects the features, is installed."""
    return IS_INSTALLED


def find_features(picture: Image) -> Features:
    """Detect the features of a picture.

    Args:
        picture: `[H, W, 3]` sRGB.
    """
    gray = np.ascontiguousarray(picture.astype(np.float32) @ _LUMA_WEIGHTS / 255, dtype=np.float32)
    options = pycolmap.FeatureExtractionOptions()
    options.sift.max_num_features = _MAX_FEATURES
    with silence_colmap():
        extractor = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)
        keypoints, descriptor_data = extractor.extract_from_float32_array(gray)
    descriptors = descriptor_data.data.astype(np.float32).reshape(-1, _DESCRIPTOR_SIZE)
    positions = np.array([(point.x, point.y) for point in keypoints], dtype=np.float64)
    lengths = np.maximum(np.linalg.norm(descriptors, axis=1, keepdims=True), 1e-9)
    return Features(positions.reshape(-1, 2), descriptors / lengths)


def match_features(first: Features, second: Features) -> tuple[Float64Array, Float64Array]:
    """Return the `[m, 2]` positions of matching features in both pictures, without outliers.

    Matches are mutual nearest neighbors that pass Lowe's ratio test and fit the estimated
    fundamental matrix. If too few matches fit the matrix, the result is empty.
    """
    no_positions = np.empty((0, 2))
    if min(len(first.positions), len(second.positions)) < _MIN_MATCHES:
        return no_positions, no_positions
    similarities = first.descriptors @ second.descriptors.T
    best_indices = similarities.argmax(axis=1)
    indices = np.arange(len(best_indices))
    is_mutual = similarities.argmax(axis=0)[best_indices] == indices
    distances = np.sqrt(np.maximum(2 - 2 * np.sort(similarities, axis=1)[:, -2:], 0))
    kept_indices = np.flatnonzero(
        is_mutual & (distances[:, 1] < _MAX_DISTANCE_RATIO * distances[:, 0])
    )
    if kept_indices.size < _MIN_MATCHES:
        return no_positions, no_positions
    first_positions, second_positions = (
        first.positions[kept_indices],
        second.positions[best_indices[kept_indices]],
    )
    options = pycolmap.RANSACOptions()
    options.max_error, options.random_seed = _MAX_EPIPOLAR_DISTANCE, 0
    estimate = pycolmap.estimate_fundamental_matrix(first_positions, second_positions, options)
    if estimate is None or estimate["num_inliers"] < _MIN_MATCHES:
        return no_positions, no_positions
    return first_positions[estimate["inlier_mask"]], second_positions[estimate["inlier_mask"]]
