"""Computes dense initial points where the depth maps of at least three cameras agree.

Sparse points exist only at distinctive image features, and training from few initial points gives
lower quality. A pixel becomes a point if at least three cameras, including its own, see a surface
at the pixel's depth, and if these cameras outnumber those that see a surface behind it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array, measure_depths
from quarc_ref.datasets.capture import Image, Points, join_points
from quarc_ref.datasets.plane_sweep import Depths, View, find_depths, find_neighbors, make_view

_AGREEMENT_TOLERANCE = 0.01  # Maximum difference of depths that agree, relative to the depth.
# A surface is behind a point if it is farther away by more than this part of the point's depth.
_CONTRADICTION_MARGIN = 0.05
_MIN_AGREEING_CAMERAS = 3
_MAX_POINTS = 40_000
_SEED = 0


def add_dense_points(
    cameras: Sequence[CalibratedCamera], pictures: Sequence[Image], sparse_points: Points
) -> Points:
    """Add dense points to sparse points, on surfaces that at least three cameras see.

    The result is deterministic. The computation takes a third of a second per camera.

    Args:
        cameras: Pinhole cameras.
        pictures: `[camera]` pictures, each `[H, W, 3]` sRGB.
        sparse_points: Sparse points of the scene, which determine the range of depths to search.

    Returns:
        Up to 40,000 dense points, and the sparse points that the depth maps do not contradict.
    """
    views = [
        make_view(camera, picture, depths)
        for camera, picture in zip(cameras, pictures, strict=True)
        if (depths := measure_depths(camera, sparse_points.positions)).size
    ]
    neighbors = find_neighbors(views, np.median(sparse_points.positions, axis=0))
    depth_views = [
        _DepthView(view, find_depths(view, [views[index] for index in neighbor_indices]))
        for view, neighbor_indices in zip(views, neighbors, strict=True)
    ]
    dense_points = _subsample(
        join_points([_make_confirmed_points(depth_view, depth_views) for depth_view in depth_views])
    )
    agreement = _measure_agreement(sparse_points.positions, depth_views)
    is_kept = agreement.contradicting_counts <= agreement.agreeing_counts
    return join_points(
        [dense_points, Points(sparse_points.positions[is_kept], sparse_points.colors[is_kept])]
    )


@dataclass(frozen=True, slots=True, eq=False)
class _DepthView:
    """A view and its depth map, `[H, W]` world units."""

    view: View
    depths: Depths


@dataclass(frozen=True, slots=True, eq=False)
class _DepthAgreement:
    """How well the cameras' depth maps agree with each of P points.

    Attributes:
        agreeing_counts: `[P]` number of cameras that see a surface at the point.
        contradicting_counts: `[P]` number of cameras that see a surface behind the point.
        depth_ratios: `[P]` mean depth in the depth maps of the agreeing cameras, divided by the
            point's depth.
    """

    agreeing_counts: NDArray[np.int64]
    contradicting_counts: NDArray[np.int64]
    depth_ratios: Float64Array


def _make_confirmed_points(depth_view: _DepthView, depth_views: Sequence[_DepthView]) -> Points:
    """Return a point for each pixel of a view if other views confirm the pixel's depth."""
    view, depths = depth_view.view, depth_view.depths
    rows, columns = np.nonzero(depths)
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=1) @ np.linalg.inv(view.matrix).T
    camera_positions: Float64Array = rays * depths[rows, columns, None]
    agreement = _measure_agreement(view.to_world(camera_positions), depth_views)
    is_confirmed = (agreement.agreeing_counts >= _MIN_AGREEING_CAMERAS) & (
        agreement.contradicting_counts < agreement.agreeing_counts
    )
    corrected_positions = (
        camera_positions[is_confirmed] * agreement.depth_ratios[is_confirmed, None]
    )
    positions = view.to_world(corrected_positions)
    return Points(
        positions.astype(np.float32), view.picture[rows[is_confirmed], columns[is_confirmed]]
    )


def _measure_agreement(
    positions: NDArray[np.floating], depth_views: Sequence[_DepthView]
) -> _DepthAgreement:
    """For each point, count the cameras that see a surface at the point or behind it."""
    agreeing_counts, contradicting_counts = np.zeros((2, len(positions)), np.int64)
    ratio_sum = np.zeros(len(positions))
    for depth_view in depth_views:
        ratios = _compute_depth_ratios(positions, depth_view)
        agrees = np.abs(ratios - 1) < _AGREEMENT_TOLERANCE
        agreeing_counts += agrees
        ratio_sum += np.where(agrees, ratios, 0)
        contradicting_counts += ratios > 1 + _CONTRADICTION_MARGIN
    return _DepthAgreement(
        agreeing_counts, contradicting_counts, ratio_sum / np.maximum(agreeing_counts, 1)
    )


def _compute_depth_ratios(positions: NDArray[np.floating], depth_view: _DepthView) -> Float64Array:
    """Return the ratio of the depth map's value to each point's depth; 0 outside the map."""
    view, depths = depth_view.view, depth_view.depths
    camera_positions = view.rotation @ positions.T + view.translation[:, None]
    front_indices = np.flatnonzero(camera_positions[2] > 0)
    columns, rows, _ = np.rint(
        view.matrix @ (camera_positions[:, front_indices] / camera_positions[2, front_indices])
    )
    height, width = depths.shape
    is_inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    visible_indices = front_indices[is_inside]
    ratios = np.zeros(len(positions))
    ratios[visible_indices] = (
        depths[rows[is_inside].astype(int), columns[is_inside].astype(int)]
        / camera_positions[2, visible_indices]
    )
    return ratios


def _subsample(points: Points) -> Points:
    """Return at most `_MAX_POINTS` of the points, drawn at random with a fixed seed."""
    count = len(points.positions)
    if count <= _MAX_POINTS:
        return points
    indices = np.sort(np.random.default_rng(_SEED).choice(count, _MAX_POINTS, replace=False))
    return Points(points.positions[indices], points.colors[indices])
