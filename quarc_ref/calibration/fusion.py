"""Merges the features of one camera at several moments into the features of one picture.

Cameras do not move, so the features of all moments can be treated as those of one picture.
Detections that agree in position, size and orientation at several moments are merged into one
feature. Without merging, a wrong match of static texture would be counted once per moment.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Keypoints = NDArray[np.float32]  # [K, 6]: x, y in pixels, 2 x 2 affine shape in row-major order
Indices = NDArray[np.int64]

_POSITION_TOLERANCE = 1.0  # pixels between two detections of a feature
_SIZE_TOLERANCE = 0.25  # natural logarithm of the size ratio of two detections
_ANGLE_TOLERANCE = 0.35  # radians


def fuse_keypoints(keypoints_by_moment: Sequence[Keypoints]) -> tuple[Keypoints, list[Indices]]:
    """Merge the keypoints of all moments into one list.

    Args:
        keypoints_by_moment: `[K, 6]` keypoints of each moment in COLMAP's format.

    Returns:
        `[F, 6]` merged keypoints, each at the mean position of its detections; and one `[K]` array
        per moment, which maps each keypoint to the index of its merged keypoint.
    """
    fused = np.zeros((0, 6), np.float64)
    detection_counts = np.zeros(0)
    indices_by_moment: list[Indices] = []
    for keypoints in keypoints_by_moment:
        indices = _find_merged_features(fused, keypoints)
        matched = np.flatnonzero(indices >= 0)
        merged_indices = indices[matched]
        fused[merged_indices, :2] += (keypoints[matched, :2] - fused[merged_indices, :2]) / (
            detection_counts[merged_indices, None] + 1
        )
        detection_counts[merged_indices] += 1
        unmatched = np.flatnonzero(indices < 0)
        indices[unmatched] = len(fused) + np.arange(len(unmatched))
        fused = np.concatenate([fused, keypoints[unmatched]])
        detection_counts = np.concatenate([detection_counts, np.ones(len(unmatched))])
        indices_by_moment.append(indices)
    return fused.astype(np.float32), indices_by_moment


def keep_one_to_one(pairs: Indices) -> Indices:
    """Keep at most one match per feature; matches found at more moments take precedence.

    Args:
        pairs: `[M, 2]` indices of features in two cameras, from all moments.

    Returns:
        `[N, 2]` matches, in which no feature occurs twice.
    """
    unique_pairs, counts = np.unique(pairs, axis=0, return_counts=True)
    unique_pairs = unique_pairs[np.argsort(-counts, kind="stable")]
    used_first: set[int] = set()
    used_second: set[int] = set()
    kept_rows = []
    for index, (first, second) in enumerate(unique_pairs.tolist()):
        if first not in used_first and second not in used_second:
            used_first.add(first)
            used_second.add(second)
            kept_rows.append(index)
    return unique_pairs[kept_rows]


def _find_merged_features(fused: NDArray[np.float64], keypoints: Keypoints) -> Indices:
    """Return `[K]`: the index of each keypoint's merged feature, or -1 if there is none."""
    indices = np.full(len(keypoints), -1, np.int64)
    if not len(fused) or not len(keypoints):
        return indices
    tree = cKDTree(_scale_by_tolerances(fused))
    neighbors = tree.query(_scale_by_tolerances(keypoints), distance_upper_bound=1.0)
    distances, nearest = (np.asarray(values) for values in neighbors)
    used_features: set[int] = set()
    for index in np.argsort(distances, kind="stable"):
        if not np.isfinite(distances[index]):
            break
        if (feature := int(nearest[index])) not in used_features:
            used_features.add(feature)
            indices[index] = feature
    return indices


def _scale_by_tolerances(keypoints: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return `[K, 5]` position, size and orientation, each divided by its tolerance."""
    x, y, a, b, c, d = keypoints.astype(np.float64).T
    size = 0.5 * np.log(np.maximum(np.abs(a * d - b * c), 1e-12))
    angle = np.arctan2(c, a)
    direction = np.stack([np.cos(angle), np.sin(angle)]) / _ANGLE_TOLERANCE
    return np.stack(
        [x / _POSITION_TOLERANCE, y / _POSITION_TOLERANCE, size / _SIZE_TOLERANCE, *direction],
        axis=1,
    )
