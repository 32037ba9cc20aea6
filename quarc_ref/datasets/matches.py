"""Detects SIFT features with pycolmap, and matches the features of two pictures.

Matching does not use the poses of the cameras, so that matches can be used to check the poses.
"""

from dataclasses import dataclass

import numpy as np
import pycolmap
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import Numbers
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.colmap_cameras import quiet

_MAX_FEATURES = 2000
_NUMBERS = 128  # Dimension of a descriptor.
_RATIO = 0.8  # Largest ratio of distances that passes Lowe's test.
_MIN_MATCHES = 16
_MAX_PIXELS_OFF = 1.5  # pixels: maximum distance of an inlier from its epipolar line
_LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """SIFT features of a picture.

    Attributes:
        positions: `[n, 2]` positions in pixels, pixel centers at +0.5.
        descriptors: `[n, 128]` SIFT descriptors, unit vectors.
    """

    positions: Numbers
    descriptors: NDArray[np.float32]


def find_features(picture: Image) -> Features:
    """Detect the features of a picture.

    Args:
        picture: `[H, W, 3]` sRGB.
    """
    gray = np.ascontiguousarray(picture.astype(np.float32) @ _LUMA / 255, dtype=np.float32)
    options = pycolmap.FeatureExtractionOptions()
    options.sift.max_num_features = _MAX_FEATURES
    with quiet():
        extractor = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)
        keypoints, coded = extractor.extract_from_float32_array(gray)
    descriptors = coded.data.astype(np.float32).reshape(-1, _NUMBERS)
    positions = np.array([(point.x, point.y) for point in keypoints], dtype=np.float64)
    lengths = np.maximum(np.linalg.norm(descriptors, axis=1, keepdims=True), 1e-9)
    return Features(positions.reshape(-1, 2), descriptors / lengths)


def match(first: Features, second: Features) -> tuple[Numbers, Numbers]:
    """Return the `[m, 2]` positions of matching features in both pictures, without outliers.

    Matches are mutual nearest neighbors, pass Lowe's ratio test and fit one fundamental matrix. If
    too few matches fit the matrix, the result is empty.
    """
    none = np.empty((0, 2))
    if min(len(first.positions), len(second.positions)) < _MIN_MATCHES:
        return none, none
    likeness = first.descriptors @ second.descriptors.T
    best = likeness.argmax(axis=1)
    rows = np.arange(len(best))
    mutual = likeness.argmax(axis=0)[best] == rows
    distances = np.sqrt(np.maximum(2 - 2 * np.sort(likeness, axis=1)[:, -2:], 0))
    kept = np.flatnonzero(mutual & (distances[:, 1] < _RATIO * distances[:, 0]))
    if kept.size < _MIN_MATCHES:
        return none, none
    ours, theirs = first.positions[kept], second.positions[best[kept]]
    options = pycolmap.RANSACOptions()
    options.max_error, options.random_seed = _MAX_PIXELS_OFF, 0
    found = pycolmap.estimate_fundamental_matrix(ours, theirs, options)
    if found is None or found["num_inliers"] < _MIN_MATCHES:
        return none, none
    return ours[found["inlier_mask"]], theirs[found["inlier_mask"]]
