"""Merges the features of one camera at several moments into those of one picture.

The cameras are static, so all features of a camera can belong to one picture. A feature
with the same place, size and orientation at two moments is the same feature and counts
once: otherwise a wrong match of static texture would count once per moment.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Keypoints = NDArray[np.float32]  # [K, 6]: x, y in pixels, affine shape row by row
Indices = NDArray[np.int64]

_PLACE = 1.0  # pixels by which two detections of a feature may differ
_SIZE = 0.25  # natural logarithm of the ratio of two sizes of a feature
_TURN = 0.35  # radians


def fuse_keypoints(moments: Sequence[Keypoints]) -> tuple[Keypoints, list[Indices]]:
    """Return the features of all moments as one list.

    Args:
        moments: `[moment]` of `[K, 6]` keypoints in COLMAP's form.

    Returns:
        `[F, 6]` merged keypoints, each at the mean position of its detections, and for
        each moment the `[K]` indices of its keypoints in them.
    """
    fused = np.zeros((0, 6), np.float64)
    counts = np.zeros(0)
    places: list[Indices] = []
    for keypoints in moments:
        place = _group_keypoints(fused, keypoints)
        old = np.flatnonzero(place >= 0)
        into = place[old]
        fused[into, :2] += (keypoints[old, :2] - fused[into, :2]) / (counts[into, None] + 1)
        counts[into] += 1
        new = np.flatnonzero(place < 0)
        place[new] = len(fused) + np.arange(len(new))
        fused = np.concatenate([fused, keypoints[new]])
        counts = np.concatenate([counts, np.ones(len(new))])
        places.append(place)
    return fused.astype(np.float32), places


def keep_one_to_one(pairs: Indices) -> Indices:
    """Return matches in which no feature occurs twice, the most frequent ones first.

    Args:
        pairs: `[M, 2]` indices of features in two cameras, from all moments.

    Returns:
        `[N, 2]` matches.
    """
    unique, counts = np.unique(pairs, axis=0, return_counts=True)
    unique = unique[np.argsort(-counts, kind="stable")]
    left: set[int] = set()
    right: set[int] = set()
    kept = []
    for index, (first, second) in enumerate(unique.tolist()):
        if first not in left and second not in right:
            left.add(first)
            right.add(second)
            kept.append(index)
    return unique[kept]


def _group_keypoints(fused: NDArray[np.float64], keypoints: Keypoints) -> Indices:
    """Return `[K]` index of the feature that each keypoint belongs to, or -1."""
    found = np.full(len(keypoints), -1, np.int64)
    if not len(fused) or not len(keypoints):
        return found
    found_near = cKDTree(_describe(fused)).query(_describe(keypoints), distance_upper_bound=1.0)
    distances, nearest = (np.asarray(values) for values in found_near)
    taken: set[int] = set()
    for index in np.argsort(distances, kind="stable"):
        if not np.isfinite(distances[index]):
            break
        if (feature := int(nearest[index])) not in taken:
            taken.add(feature)
            found[index] = feature
    return found


def _describe(keypoints: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return `[K, 5]` position, size and orientation, scaled so that 1 is the tolerance."""
    x, y, a, b, c, d = keypoints.astype(np.float64).T
    size = 0.5 * np.log(np.maximum(np.abs(a * d - b * c), 1e-12))
    angle = np.arctan2(c, a)
    turn = np.stack([np.cos(angle), np.sin(angle)]) / _TURN
    return np.stack([x / _PLACE, y / _PLACE, size / _SIZE, *turn], axis=1)
