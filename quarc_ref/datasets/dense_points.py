"""Computes dense initial points by plane sweep, where the depth maps of three cameras agree.

Sparse points lie only at picture corners, and training from few initial points gives lower quality.
A pixel's depth becomes a point if the depth maps of at least three cameras, including the pixel's
camera, agree, and if they outnumber the cameras that see a surface behind the point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import CalibratedCamera, Numbers, measure_depths
from quarc_ref.datasets.capture import Image, Points, join_points
from quarc_ref.datasets.plane_sweep import Depths, View, find_depths, find_neighbors, make_view

_AGREEMENT = 0.01  # Maximum difference of depths that agree, relative to the depth.
_BEHIND = 0.05  # A surface is behind a point if it is farther by this part of the point's depth.
_MIN_AGREEING = 3  # cameras
_MAX_POINTS = 40_000
_SEED = 0


def densify(
    cameras: Sequence[CalibratedCamera], pictures: Sequence[Image], sparse: Points
) -> Points:
    """Add dense points, on surfaces that at least three cameras see, to sparse points.

    The result is deterministic. The computation takes about half a second of CPU time per camera.

    Args:
        cameras: Pinhole cameras.
        pictures: `[camera]` pictures, each `[H, W, 3]` sRGB.
        sparse: Sparse points of the scene, which determine the range of depths to search.

    Returns:
        Up to 40,000 dense points, and the sparse points that the depth maps do not contradict.
    """
    views = [
        make_view(camera, picture, depths)
        for camera, picture in zip(cameras, pictures, strict=True)
        if (depths := measure_depths(camera, sparse.positions)).size
    ]
    neighbors = find_neighbors(views, np.median(sparse.positions, axis=0))
    surfaces = [
        _Surface(view, find_depths(view, [views[other] for other in others]))
        for view, others in zip(views, neighbors, strict=True)
    ]
    dense = _subsample(join_points([_keep_agreeing(surface, surfaces) for surface in surfaces]))
    verdict = _judge(sparse.positions, surfaces)
    kept = verdict.behind <= verdict.agreeing
    return join_points([dense, Points(sparse.positions[kept], sparse.colors[kept])])


@dataclass(frozen=True, slots=True, eq=False)
class _Surface:
    """A view and its depth map, `[H, W]` world units."""

    view: View
    depths: Depths


@dataclass(frozen=True, slots=True, eq=False)
class _Verdict:
    """How well the cameras' depth maps agree with each of P points.

    Attributes:
        agreeing: `[P]` number of cameras that see a surface at the point.
        behind: `[P]` number of cameras that see a surface behind the point.
        ratios: `[P]` mean depth of the agreeing cameras, relative to the point's depth.
    """

    agreeing: NDArray[np.int64]
    behind: NDArray[np.int64]
    ratios: Numbers


def _keep_agreeing(surface: _Surface, surfaces: Sequence[_Surface]) -> Points:
    """Return one point per pixel of a view whose depth other views confirm."""
    view, depths = surface.view, surface.depths
    rows, columns = np.nonzero(depths)
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=1) @ np.linalg.inv(view.matrix).T
    rays *= depths[rows, columns, None]
    verdict = _judge(view.to_world(rays), surfaces)
    kept = (verdict.agreeing >= _MIN_AGREEING) & (verdict.behind < verdict.agreeing)
    positions = view.to_world(rays[kept] * verdict.ratios[kept, None])
    return Points(positions.astype(np.float32), view.picture[rows[kept], columns[kept]])


def _judge(positions: NDArray[np.floating], surfaces: Sequence[_Surface]) -> _Verdict:
    """Count the cameras that see a surface at each point, and behind each point."""
    agreeing, behind = np.zeros((2, len(positions)), np.int64)
    total = np.zeros(len(positions))
    for surface in surfaces:
        ratios = _compare_depths(positions, surface)
        agrees = np.abs(ratios - 1) < _AGREEMENT
        agreeing += agrees
        total += np.where(agrees, ratios, 0)
        behind += ratios > 1 + _BEHIND
    return _Verdict(agreeing, behind, total / np.maximum(agreeing, 1))


def _compare_depths(positions: NDArray[np.floating], surface: _Surface) -> Numbers:
    """Return `[P]` depth map values divided by the depths of the points; 0 outside the picture."""
    view, depths = surface.view, surface.depths
    places = view.rotation @ positions.T + view.translation[:, None]
    ahead = np.flatnonzero(places[2] > 0)
    across, down, _ = np.rint(view.matrix @ (places[:, ahead] / places[2, ahead]))
    height, width = depths.shape
    inside = (across >= 0) & (across < width) & (down >= 0) & (down < height)
    seen = ahead[inside]
    ratios = np.zeros(len(positions))
    ratios[seen] = depths[down[inside].astype(int), across[inside].astype(int)] / places[2, seen]
    return ratios


def _subsample(points: Points) -> Points:
    """Return at most `_MAX_POINTS` of the points, drawn at random with a fixed seed."""
    count = len(points.positions)
    if count <= _MAX_POINTS:
        return points
    kept = np.sort(np.random.default_rng(_SEED).choice(count, _MAX_POINTS, replace=False))
    return Points(points.positions[kept], points.colors[kept])
