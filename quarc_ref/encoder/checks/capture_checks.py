"""Checks whether a capture can be encoded with good quality, using only frame 0.

The checks rely on the initial points, which show where the scene is. Training overfits
individual views if few views see a point, if neighboring views see it from very different
directions, or if the views show it in different colors. The thresholds were chosen on synthetic
and real captures with 3 to 30 cameras (docs/experiments/capture-checks.md).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import camera_center, project_points
from quarc_ref.datasets.capture import Capture, Points
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.encoder.checks.blank_pictures import are_blank, find_blank_first_pictures
from quarc_ref.encoder.checks.mask_checks import find_black_masks, find_faint_alpha
from quarc_ref.encoder.checks.picture_checks import find_odd_pictures
from quarc_ref.encoder.checks.pose_checks import MIN_TRAINING_CAMERAS, find_wrong_poses
from quarc_ref.encoder.checks.projected_points import ProjectedPoints, read_first_frame
from quarc_ref.encoder.steps import measure_pixel_size, measure_reach
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import UnusableCaptureError

_MAX_SAMPLED_POINTS = 20000
# Number of views that should see a point: two views leave depth along the baseline ambiguous.
_RECOMMENDED_VIEWS = 3
_MAX_RARELY_SEEN_FRACTION = 0.5
_MAX_PARALLAX_DEGREES = 25.0
_MAX_OUTSIDE_FRACTION = 0.2
_MIN_FRACTION_OF_MEDIAN_COUNT = 0.02
# Distance from the center of all cameras, relative to the median depth of the points, below
# which cameras count as coinciding. At this depth, it spans about half a degree.
_MIN_RELATIVE_RADIUS = 0.01
# Distance from the origin, in pixels at the scene's distance, above which positions are inaccurate.
# There, float32, in which training computes, has steps of 1/128 of a pixel, and a lattice that
# covers four times this distance has only 42 units per pixel.
_MAX_REACH_PIXELS = 50_000


def check_capture(capture: Capture) -> list[Finding]:
    """Return findings that predict poor quality, based only on frame 0.

    Args:
        capture: The capture; its held-out cameras are not read.

    Raises:
        UnusableCaptureError: The capture cannot be encoded with acceptable quality.
        CaptureError: A picture or mask cannot be read.
    """
    cameras = tuple(capture.cameras[index] for index in capture.full_capture.training_at(0))
    if len(cameras) < MIN_TRAINING_CAMERAS:
        message = (
            f"capture {capture.name} has {len(cameras)} training camera, but estimating depth "
            f"needs at least {MIN_TRAINING_CAMERAS}: hold out fewer cameras, or add cameras"
        )
        raise UnusableCaptureError(message)
    projected = _measure_visibility(capture, cameras)
    if not projected.is_visible.any():
        message = (
            f"none of the {len(capture.points.positions)} initial points of capture "
            f"{capture.name} is visible in a training view: check that poses and points have "
            "the same axes, origin and scale"
        )
        raise UnusableCaptureError(message)
    return [
        *find_blank_first_pictures(projected),
        *find_black_masks(capture),
        *find_faint_alpha(capture),
        *_find_distant_origin(projected, capture.points),
        *_find_points_outside_views(projected),
        *_find_blind_cameras(projected),
        *_find_coinciding_cameras(projected),
        *_find_too_few_cameras(projected),
        *find_wrong_poses(capture, projected),
        *_find_odd_pictures(capture, projected),
    ]


def _measure_visibility(capture: Capture, cameras: tuple[Camera, ...]) -> ProjectedPoints:
    points = capture.points
    indices = np.random.default_rng(0).permutation(len(points.positions))[:_MAX_SAMPLED_POINTS]
    positions = points.positions[indices]
    projections = tuple(project_points(camera, positions) for camera in cameras)
    is_visible = np.stack([projection.is_visible for projection in projections])
    return ProjectedPoints(
        cameras,
        positions,
        points.colors[indices],
        projections,
        is_visible,
        are_blank(read_first_frame(capture)) & (capture.alphas is None),
    )


def _find_odd_pictures(capture: Capture, projected: ProjectedPoints) -> Iterator[Finding]:
    """Return the findings of `find_odd_pictures`; pictures that show nothing are not compared."""
    positions = [
        position
        for position, picture in enumerate(read_first_frame(capture))
        if not projected.is_blank[position] and (capture.alphas is None or picture.any())
    ]
    if len(positions) < MIN_TRAINING_CAMERAS:
        return iter(())
    full_capture = capture.full_capture
    indices = full_capture.training_at(0)
    return find_odd_pictures(
        [projected.cameras[position] for position in positions],
        [projected.projections[position] for position in positions],
        (full_capture.image(indices[position], 0) for position in positions),
    )


def _find_distant_origin(projected: ProjectedPoints, points: Points) -> Iterator[Finding]:
    reach = measure_reach(projected.cameras, points)
    pixel_size = measure_pixel_size(projected.cameras, points)
    if reach > _MAX_REACH_PIXELS * pixel_size:
        message = (
            f"cameras and points reach {reach:.3g} world units from the origin, where a pixel is "
            f"only {pixel_size:.2g} units wide, so positions will be inaccurate: move the origin "
            "of poses and points into the scene, or remove distant points"
        )
        yield Finding("distant-origin", message)


def _find_points_outside_views(projected: ProjectedPoints) -> Iterator[Finding]:
    outside_fraction = float(np.mean(~projected.is_visible.any(axis=0)))
    if outside_fraction > _MAX_OUTSIDE_FRACTION:
        behind_fraction = float(
            np.mean(
                np.all([projection.depths <= 0 for projection in projected.projections], axis=0)
            )
        )
        message = (
            f"{outside_fraction:.0%} of the initial points are not visible in any training view "
            f"({behind_fraction:.0%} are behind all cameras): check that poses and points match"
        )
        yield Finding("points-outside-views", message)


def _find_blind_cameras(projected: ProjectedPoints) -> Iterator[Finding]:
    point_counts = projected.is_visible.sum(axis=1)
    min_count = _MIN_FRACTION_OF_MEDIAN_COUNT * np.median(point_counts)
    blind_cameras = projected.name_cameras(np.flatnonzero(point_counts < min_count))
    if blind_cameras:
        message = (
            "hardly any initial points are visible in the pictures of "
            f"{format_names(blind_cameras)}: check the poses of these cameras"
        )
        yield Finding("camera-sees-no-points", message, blind_cameras)


def _find_coinciding_cameras(projected: ProjectedPoints) -> Iterator[Finding]:
    centers = np.stack([camera_center(camera) for camera in projected.cameras])
    max_radius = np.linalg.norm(centers - centers.mean(axis=0), axis=1).max()
    depths = np.concatenate(
        [projection.depths[projection.is_visible] for projection in projected.projections]
    )
    if max_radius < _MIN_RELATIVE_RADIUS * np.median(depths):
        message = (
            "all training cameras are at the same position, so depth cannot be estimated: "
            "move them apart, or check their poses"
        )
        yield Finding("cameras-in-one-place", message)


def _find_too_few_cameras(projected: ProjectedPoints) -> Iterator[Finding]:
    rarely_seen_fraction = float(np.mean(projected.is_visible.sum(axis=0) < _RECOMMENDED_VIEWS))
    parallax_degrees = _measure_parallax(projected)
    if rarely_seen_fraction > _MAX_RARELY_SEEN_FRACTION or parallax_degrees > _MAX_PARALLAX_DEGREES:
        message = (
            f"{len(projected.cameras)} training cameras are too few for this scene: "
            f"{rarely_seen_fraction:.0%} of the initial points are seen by fewer than "
            f"{_RECOMMENDED_VIEWS} of them, and neighboring cameras see a point from directions "
            f"{parallax_degrees:.0f} degrees apart (at most {_MAX_PARALLAX_DEGREES:.0f} are "
            "recommended). Quality between the cameras will be poor: add cameras"
        )
        yield Finding("too-few-cameras", message)


def _measure_parallax(projected: ProjectedPoints) -> float:
    """Return the median angle between neighboring cameras as seen from a point, in degrees.

    For each camera and each point that it sees, the angle at the point is measured between the
    directions to this camera and to the nearest other camera that sees the point. The result is
    0 if no point is visible in two cameras.
    """
    centers = np.stack([camera_center(camera) for camera in projected.cameras])
    directions = projected.positions - centers[:, None]
    directions /= np.maximum(np.linalg.norm(directions, axis=2, keepdims=True), 1e-12)
    cosines_by_camera = [
        _nearest_cosines(directions, projected.is_visible, view) for view in range(len(centers))
    ]
    valid_cosines = np.concatenate([cosines[cosines >= -1] for cosines in cosines_by_camera])
    return (
        float(np.degrees(np.arccos(np.clip(np.median(valid_cosines), -1, 1))))
        if valid_cosines.size
        else 0.0
    )


def _nearest_cosines(
    directions: NDArray[np.float64], is_visible: NDArray[np.bool_], view: int
) -> NDArray[np.float64]:
    """Return `[P]` cosines of the angle at each point between a view and the nearest other view.

    The value is -2 unless both the view and another view see the point.
    """
    cosines = np.einsum("vpk,pk->vp", directions, directions[view])
    is_shared = is_visible & is_visible[view]
    is_shared[view] = False
    nearest_cosines: NDArray[np.float64] = np.where(is_shared, np.maximum(cosines, -1), -2).max(
        axis=0
    )
    return nearest_cosines
