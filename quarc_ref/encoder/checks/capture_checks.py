"""Checks before training whether a capture can be encoded with good quality, or at all.

The initial points show where the scene is. If training views hardly see them, see them
from very different directions, or show other colors at their projections, training
overfits the individual views. Thresholds were chosen on traced and real captures with 3
to 30 cameras: docs/experiments/capture-checks.md.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import PointProjection, camera_center, project_points
from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.encoder.checks.color_agreement import compare_colors
from quarc_ref.encoder.checks.picture_checks import find_odd_pictures
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import UnusableCaptureError

_MAX_POINTS = 20000
_MIN_VIEWS = 2
_ENOUGH_VIEWS = 3  # views that should see a point: with two, depth along the baseline is ambiguous
_MAX_SEEN_BY_FEW = 0.5
_MAX_DEGREES = 25.0
_MAX_OUTSIDE = 0.2
_MIN_OF_MEDIAN = 0.02
_MIN_RADIUS = 0.01  # relative to the cameras' distance from the points they see: half a degree


@dataclass(frozen=True, slots=True, eq=False)
class _ProjectedPoints:
    """Some initial points, projected into all training views.

    Attributes:
        cameras: The training views.
        positions: `[P, 3]` positions, world units.
        colors: `[P, 3]` sRGB colors.
        views: Projections of the points, one per camera.
        is_visible: `[V, P]` whether a camera sees a point.
    """

    cameras: tuple[Camera, ...]
    positions: NDArray[np.float32]
    colors: NDArray[np.uint8]
    views: tuple[PointProjection, ...]
    is_visible: NDArray[np.bool_]


def check_capture(capture: Capture) -> list[Finding]:
    """Find reasons to expect poor quality, using frame 0 only.

    Args:
        capture: The capture, whose held-out cameras are not read.

    Raises:
        UnusableCaptureError: The capture cannot be encoded with useful quality.
        CaptureError: A picture cannot be read.
    """
    cameras = tuple(capture.cameras[index] for index in capture.training)
    if len(cameras) < _MIN_VIEWS:
        message = (
            f"capture {capture.name} has {len(cameras)} training camera, but estimating depth "
            f"needs at least {_MIN_VIEWS}: hold out fewer cameras, or add some"
        )
        raise UnusableCaptureError(message)
    seen = _measure_visibility(capture, cameras)
    if not seen.is_visible.any():
        message = (
            f"none of the {len(capture.points.positions)} initial points of capture "
            f"{capture.name} is visible in a training view: check that poses and points have "
            "the same axes, origin and scale"
        )
        raise UnusableCaptureError(message)
    return [
        *_find_lost_points(seen),
        *_find_blind_cameras(seen),
        *_find_one_place(seen),
        *_find_too_few_cameras(seen),
        *_find_wrong_poses(capture, seen),
        *find_odd_pictures(seen.cameras, seen.views, _read_first(capture)),
    ]


def _measure_visibility(capture: Capture, cameras: tuple[Camera, ...]) -> _ProjectedPoints:
    points = capture.points
    drawn = np.random.default_rng(0).permutation(len(points.positions))[:_MAX_POINTS]
    positions = points.positions[drawn]
    views = tuple(project_points(camera, positions) for camera in cameras)
    within = np.stack([view.is_visible for view in views])
    return _ProjectedPoints(cameras, positions, points.colors[drawn], views, within)


def _find_lost_points(seen: _ProjectedPoints) -> Iterator[Finding]:
    outside = float(np.mean(~seen.is_visible.any(axis=0)))
    if outside > _MAX_OUTSIDE:
        behind = float(np.mean(np.all([view.depths <= 0 for view in seen.views], axis=0)))
        message = (
            f"{outside:.0%} of the initial points are not visible in any training view "
            f"({behind:.0%} are behind all cameras): check that poses and points match"
        )
        yield Finding("points-outside-views", message)


def _find_blind_cameras(seen: _ProjectedPoints) -> Iterator[Finding]:
    counts = seen.is_visible.sum(axis=1)
    blind = _name(seen.cameras, np.flatnonzero(counts < _MIN_OF_MEDIAN * np.median(counts)))
    if blind:
        message = (
            f"hardly any initial points are visible in the pictures of {format_names(blind)}: "
            "check the poses of these cameras"
        )
        yield Finding("camera-sees-no-points", message, blind)


def _find_one_place(seen: _ProjectedPoints) -> Iterator[Finding]:
    centers = np.stack([camera_center(camera) for camera in seen.cameras])
    radius = np.linalg.norm(centers - centers.mean(axis=0), axis=1).max()
    distances = np.concatenate([view.depths[view.is_visible] for view in seen.views])
    if radius < _MIN_RADIUS * np.median(distances):
        message = (
            "all training cameras are at the same position, so depth cannot be estimated: "
            "move them apart, or check their poses"
        )
        yield Finding("cameras-in-one-place", message)


def _find_too_few_cameras(seen: _ProjectedPoints) -> Iterator[Finding]:
    by_few = float(np.mean(seen.is_visible.sum(axis=0) < _ENOUGH_VIEWS))
    degrees = _measure_parallax(seen)
    if by_few > _MAX_SEEN_BY_FEW or degrees > _MAX_DEGREES:
        message = (
            f"{len(seen.cameras)} training cameras are too few for this scene: {by_few:.0%} "
            f"of the initial points are seen by fewer than {_ENOUGH_VIEWS} of them, and the "
            f"two nearest cameras of a point see it at an angle of {degrees:.0f} degrees (it "
            f"should be at most {_MAX_DEGREES:.0f}). Quality between the cameras will be "
            "poor: add cameras"
        )
        yield Finding("too-few-cameras", message)


def _measure_parallax(seen: _ProjectedPoints) -> float:
    """Measure the angle between neighboring cameras as seen from a point, in degrees.

    The result is the median, over all cameras and the points they see, of the angle to
    the nearest other camera that sees the point, or 0 if there is no such pair.
    """
    centers = np.stack([camera_center(camera) for camera in seen.cameras])
    directions = seen.positions - centers[:, None]
    directions /= np.maximum(np.linalg.norm(directions, axis=2, keepdims=True), 1e-12)
    nearest = [_nearest_cosines(directions, seen.is_visible, view) for view in range(len(centers))]
    found = np.concatenate([cosines[cosines >= -1] for cosines in nearest])
    return float(np.degrees(np.arccos(np.clip(np.median(found), -1, 1)))) if found.size else 0.0


def _nearest_cosines(
    directions: NDArray[np.float64], within: NDArray[np.bool_], view: int
) -> NDArray[np.float64]:
    """Return `[P]` cosines of the angles to each point's nearest other view; -2 without one."""
    cosines = np.einsum("vpk,pk->vp", directions, directions[view])
    shared = within & within[view]
    shared[view] = False
    nearest: NDArray[np.float64] = np.where(shared, np.maximum(cosines, -1), -2).max(axis=0)
    return nearest


def _read_first(capture: Capture) -> Iterator[Image]:
    """Yield the training views' pictures of the frame that the initial points belong to."""
    whole = capture.full_capture
    return (whole.image(index, 0) for index in whole.training)


def _find_wrong_poses(capture: Capture, seen: _ProjectedPoints) -> Iterator[Finding]:
    found = compare_colors(seen.cameras, seen.views, seen.colors, _read_first(capture))
    if found.mixed_up:
        pairs = [
            f"{seen.cameras[picture].name}: pose of {seen.cameras[pose].name}"
            for picture, pose in found.mixed_up
        ]
        message = (
            "pictures and poses are mixed up: the pictures of some cameras fit the pose of "
            f"another one better ({format_names(pairs)}): check the order of the poses"
        )
        yield Finding(
            "poses-mixed-up", message, _name(seen.cameras, [i for i, _ in found.mixed_up])
        )
    if found.wrong:
        names = _name(seen.cameras, found.wrong)
        message = (
            f"the pictures of {format_names(names)} do not show the initial points where their "
            "poses put them. If other cameras are fine, these poses are wrong: calibrate "
            "again with more matches (calibrate --moments 16), or check that pose, lens and "
            "picture belong to the same camera. If many cameras are named, the points are of "
            f"another scene or time. Until then, {_hold_out_options(capture, names)} leaves them "
            "out of training"
        )
        yield Finding("pose-disagrees", message, names)


def _hold_out_options(capture: Capture, names: Sequence[str]) -> str:
    """Return the options that hold out cameras besides those that are held out already."""
    held_out = [capture.cameras[index].name for index in capture.held_out]
    return " ".join(f"--held-out {name}" for name in [*held_out, *names])


def _name(cameras: Sequence[Camera], indices: Sequence[int] | NDArray[np.intp]) -> tuple[str, ...]:
    return tuple(cameras[index].name for index in indices)
