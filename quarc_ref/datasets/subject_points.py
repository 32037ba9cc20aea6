"""Chooses the initial points of a subject in front of a transparent background.

Of the given points, those in the visual hull are kept: the space that the training cameras see as
the subject. If they are too few, points are drawn from the hull instead.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from quarc_ref.datasets.camera_geometry import (
    PointProjection,
    camera_center,
    project_points,
    rotation_matrix,
)
from quarc_ref.datasets.capture import Alpha, Image, Mask, Points
from quarc_ref.datasets.errors import UnreadablePointsError
from quarc_ref.datasets.findings import format_names
from quarc_ref.format.cameras import Camera

_MIN_POINTS, _MIN_GIVEN_POINTS = 100, 1000
_MARGIN_PIXELS = 2  # errors of points and alpha
_MAX_TRANSPARENT_SHARE = 0.1
_HULL_POINT_COUNT = 10_000
_MIN_HULL_VIEWS = 2  # fewer views do not limit the depth of a point
_DRAWN_PER_ROUND = 200_000
_MAX_ROUNDS = 50
_SEED = 0

Float64Array = NDArray[np.float64]


def choose_subject_points(
    points: Points | None,
    cameras: Sequence[Camera],
    alphas: Sequence[Alpha],
    read_picture: Callable[[int], Image],
) -> Points:
    """Return the initial points of a subject.

    Args:
        points: Given points of the whole scene; None if there are none.
        cameras: The training cameras.
        alphas: `[camera]` alpha of their pictures in frame 0.
        read_picture: Returns the picture of a camera in frame 0, by its index in `cameras`.

    Raises:
        UnreadablePointsError: Fewer than two cameras see the subject, or its visual hull is empty.
    """
    covered_pixels = [find_covered_pixels(alpha) for alpha in alphas]
    if points is not None:
        is_subject, _ = _find_hull_points(points.positions, cameras, covered_pixels)
        if np.count_nonzero(is_subject) >= _MIN_GIVEN_POINTS:
            return Points(points.positions[is_subject], points.colors[is_subject])
    positions = _draw_hull_points(*_find_ball(cameras, alphas), cameras, covered_pixels)
    return Points(positions, _pick_colors(positions, cameras, read_picture))


def find_covered_pixels(alpha: Alpha) -> Mask:
    """Return the `[H, W]` mask of the pixels that the subject covers, and of a narrow margin."""
    return np.asarray(binary_dilation(alpha > 0, iterations=_MARGIN_PIXELS))


def find_transparent_points(projection: PointProjection, covered_pixels: Mask) -> NDArray[np.bool_]:
    """Return which points `[P]` a camera sees, but not at pixels that the subject covers."""
    is_transparent = projection.is_visible.copy()
    rows = projection.rows[is_transparent].astype(np.int64)
    columns = projection.columns[is_transparent].astype(np.int64)
    is_transparent[is_transparent] = ~covered_pixels[rows, columns]
    return is_transparent


def _find_hull_points(
    positions: NDArray[np.float32], cameras: Sequence[Camera], covered_pixels: Sequence[Mask]
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Return which points `[P, 3]` are in the hull, and how many cameras see them, both `[P]`.

    They may be transparent in a tenth of the pictures that show them, whose alpha may be wrong.
    """
    view_counts, transparent_counts = np.zeros((2, len(positions)), dtype=np.int64)
    for camera, covered in zip(cameras, covered_pixels, strict=True):
        projection = project_points(camera, positions)
        view_counts += projection.is_visible
        transparent_counts += find_transparent_points(projection, covered)
    return transparent_counts <= _MAX_TRANSPARENT_SHARE * view_counts, view_counts


def _draw_hull_points(
    center: Float64Array,
    radius: float,
    cameras: Sequence[Camera],
    covered_pixels: Sequence[Mask],
) -> NDArray[np.float32]:
    """Draw random points `[P, 3]` near a ball from the visual hull, at least `_MIN_POINTS`.

    Where few cameras see the hull, it is much larger than the subject, so none are drawn there.
    """
    generator = np.random.default_rng(_SEED)
    parts: list[NDArray[np.float32]] = []
    for _ in range(_MAX_ROUNDS):
        drawn = center + generator.uniform(-radius, radius, (_DRAWN_PER_ROUND, 3))
        positions = drawn.astype(np.float32)
        is_inside, view_counts = _find_hull_points(positions, cameras, covered_pixels)
        min_views = max(_MIN_HULL_VIEWS, view_counts[is_inside].max(initial=0) / 2)
        is_well_seen = view_counts >= min_views
        parts.append(positions[is_inside & is_well_seen])
        if sum(map(len, parts)) >= _HULL_POINT_COUNT:
            break
    hull_points: NDArray[np.float32] = np.concatenate(parts)[:_HULL_POINT_COUNT]
    if len(hull_points) < _MIN_POINTS:
        empty_views = _describe_empty_views(cameras, covered_pixels)
        message = (
            f"no place is covered by the subject in all training views of frame 0{empty_views}: "
            "check that masks or alpha channels belong to their cameras, and that the poses are "
            "right"
        )
        raise UnreadablePointsError(message)
    return hull_points


def _describe_empty_views(cameras: Sequence[Camera], covered_pixels: Sequence[Mask]) -> str:
    """Name the cameras whose pictures are transparent everywhere; empty if there are none."""
    pairs = zip(cameras, covered_pixels, strict=True)
    names = [camera.name for camera, covered in pairs if not covered.any()]
    return f", and {format_names(names)} cannot see it at all" if names else ""


def _find_ball(cameras: Sequence[Camera], alphas: Sequence[Alpha]) -> tuple[Float64Array, float]:
    """Return the center `[3]` and the radius of a ball that contains the subject.

    The center is the point nearest to the rays through the centroids of the silhouettes.
    """
    seen = [(camera, alpha) for camera, alpha in zip(cameras, alphas, strict=True) if alpha.any()]
    if len(seen) < 2:
        message = (
            f"the subject is visible to {len(seen)} of {len(cameras)} training cameras in frame 0: "
            "check that masks or alpha channels are white or opaque on the subject, or begin with "
            "a frame that shows it (--start)"
        )
        raise UnreadablePointsError(message)
    projectors, projected_centers, silhouettes = np.zeros((3, 3)), np.zeros(3), []
    for camera, alpha in seen:
        rows, columns = np.nonzero(alpha)
        pixels = np.stack([columns + 0.5, rows + 0.5])
        centroid = pixels.mean(axis=1)
        x, y = (centroid - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
        ray = rotation_matrix(camera).T @ [x, y, 1.0]
        projector = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
        projectors += projector
        projected_centers += projector @ camera_center(camera)
        reach = np.hypot(*(pixels - centroid[:, None])).max() / min(camera.fx, camera.fy)
        silhouettes.append((camera, float(reach)))
    center = np.asarray(np.linalg.lstsq(projectors, projected_centers, rcond=None)[0], np.float64)
    radius = max(
        reach * float(np.linalg.norm(camera_center(camera) - center))
        for camera, reach in silhouettes
    )
    return center, radius


def _pick_colors(
    positions: NDArray[np.float32],
    cameras: Sequence[Camera],
    read_picture: Callable[[int], Image],
) -> NDArray[np.uint8]:
    """Return the `[P, 3]` colors of points in the picture of the nearest camera that sees them."""
    colors = np.zeros((len(positions), 3), dtype=np.uint8)
    nearest = np.full(len(positions), np.inf)
    for index, camera in enumerate(cameras):
        projection = project_points(camera, positions)
        is_nearer = projection.is_visible & (projection.depths < nearest)
        rows = projection.rows[is_nearer].astype(np.int64)
        columns = projection.columns[is_nearer].astype(np.int64)
        colors[is_nearer] = read_picture(index)[rows, columns]
        nearest[is_nearer] = projection.depths[is_nearer]
    return colors
