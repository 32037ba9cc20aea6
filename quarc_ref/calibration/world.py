"""Defines the up axis, origin and unit of a rig's world coordinates.

The orientation, origin and scale of the solver's world are arbitrary. In the resulting world,
up is -y, as in COLMAP and most 3DGS files, and the first camera looks along +z. The origin
is the point that the cameras look at. The unit is one meter if the distance between two
cameras is known, and otherwise the mean distance of the cameras from the origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.calibration.errors import CalibrationError, UnknownCameraError
from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array, make_pose

UP_FROM_LEVEL_CAMERAS = "level"
UP_FROM_CAMERA_PLANE = "plane"
UP = (0.0, -1.0, 0.0)
_MIN_DIRECTION_SPREAD = 0.02  # mean squared sine below which all cameras look in one direction
_MIN_PLANE_CAMERAS = 4
_MAX_THICKNESS_RATIO = 0.3  # maximum thickness of a planar rig, relative to its width
# Axes are parallel below this smallest eigenvalue per camera; a camera looks along the up axis
# below this length of its horizontal direction.
_PARALLEL_LIMIT = 1e-3


@dataclass(frozen=True, slots=True)
class Distance:
    """Distance between two cameras.

    Attributes:
        first: Name of the first camera.
        second: Name of the second camera.
        meters: Distance in meters.
    """

    first: str
    second: str
    meters: float


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """The cameras of a rig in its final world coordinates.

    Attributes:
        cameras: Cameras in the final world.
        up: Up direction.
        up_source: Phrase that says what determined the up direction, for reports.
        meters_per_unit: Meters per world unit; None if no distance is known.
    """

    cameras: tuple[CalibratedCamera, ...]
    up: tuple[float, float, float]
    up_source: str
    meters_per_unit: float | None


def define_world(
    cameras: Sequence[CalibratedCamera],
    points: Float64Array,
    up: str = UP_FROM_LEVEL_CAMERAS,
    distance: Distance | None = None,
) -> World:
    """Transform a rig into world coordinates with a known up direction.

    Args:
        cameras: Cameras in the world of the solver.
        points: `[P, 3]` scene points in the world of the solver.
        up: `level` if the cameras are level, `plane` if they lie in a horizontal plane,
            or the name of a level camera.
        distance: Distance between two cameras; None if unknown.

    Raises:
        CalibrationError: The cameras do not lie in a plane, or the two cameras of `distance` are
            at the same position.
        UnknownCameraError: `up` or `distance` names a camera that has no pose.
    """
    up_direction, up_source = _find_up(cameras, up)
    forward = cameras[0].pose.rotation[2]
    forward = forward - (forward @ up_direction) * up_direction
    if np.linalg.norm(forward) < _PARALLEL_LIMIT:  # the camera looks straight up or down
        forward = np.cross(up_direction, cameras[0].pose.rotation[0])
    forward /= np.linalg.norm(forward)
    rotation = np.stack([np.cross(-up_direction, forward), -up_direction, forward])
    origin = _find_look_at_point(cameras, points)
    scale = _find_scale(cameras, origin, distance)
    return World(
        tuple(_transform_camera(camera, rotation, origin, scale) for camera in cameras),
        UP,
        up_source,
        None if distance is None else 1.0,
    )


def _find_up(cameras: Sequence[CalibratedCamera], up: str) -> tuple[Float64Array, str]:
    mean_up = -np.mean([camera.pose.rotation[1] for camera in cameras], axis=0)
    if up == UP_FROM_LEVEL_CAMERAS:
        return _find_up_of_level_cameras(cameras, mean_up)
    if up == UP_FROM_CAMERA_PLANE:
        return _find_plane_normal(cameras, mean_up), "the plane of the cameras"
    return -_find_camera(cameras, up).pose.rotation[1], f"camera {up}, which is assumed to be level"


def _find_up_of_level_cameras(
    cameras: Sequence[CalibratedCamera], mean_up: Float64Array
) -> tuple[Float64Array, str]:
    """Return the up direction of level cameras, and a phrase that says how it was found."""
    right_axes = np.array([camera.pose.rotation[0] for camera in cameras])
    eigenvalues, eigenvectors = np.linalg.eigh(right_axes.T @ right_axes / len(cameras))
    if eigenvalues[1] < _MIN_DIRECTION_SPREAD:  # the roll about the common direction is ambiguous
        return mean_up / np.linalg.norm(mean_up), "the mean up direction of the cameras"
    axis = eigenvectors[:, 0]
    up = np.asarray(axis if axis @ mean_up >= 0 else -axis)
    return up, "the cameras, which are assumed to be level"


def _find_plane_normal(cameras: Sequence[CalibratedCamera], mean_up: Float64Array) -> Float64Array:
    centers = np.array([_camera_center(camera) for camera in cameras])
    _, singular_values, axes = np.linalg.svd(centers - centers.mean(axis=0))
    if (
        len(cameras) < _MIN_PLANE_CAMERAS
        or singular_values[2] > _MAX_THICKNESS_RATIO * singular_values[1]
    ):
        message = (
            "the cameras do not lie in one plane, which --up plane requires: omit --up if the "
            "cameras are level, or use --up with the name of a level camera"
        )
        raise CalibrationError(message)
    return np.asarray(axes[2] if axes[2] @ mean_up >= 0 else -axes[2])


def _find_look_at_point(cameras: Sequence[CalibratedCamera], points: Float64Array) -> Float64Array:
    """Return the point nearest to all optical axes, or the median point as a fallback."""
    projection_sum, weighted_sum = np.zeros((3, 3)), np.zeros(3)
    for camera in cameras:
        direction = camera.pose.rotation[2]
        projection = np.eye(3) - np.outer(direction, direction)
        projection_sum += projection
        weighted_sum += projection @ _camera_center(camera)
    median_point = np.median(points, axis=0)
    if np.linalg.eigvalsh(projection_sum)[0] < _PARALLEL_LIMIT * len(cameras):
        return np.asarray(median_point)
    look_at_point = np.linalg.solve(projection_sum, weighted_sum)
    is_in_front = all(
        camera.pose.rotation[2] @ look_at_point + camera.pose.translation[2] > 0
        for camera in cameras
    )
    return np.asarray(look_at_point if is_in_front else median_point)


def _find_scale(
    cameras: Sequence[CalibratedCamera], origin: Float64Array, distance: Distance | None
) -> float:
    if distance is None:
        return 1 / float(
            np.mean([np.linalg.norm(_camera_center(camera) - origin) for camera in cameras])
        )
    first, second = (_find_camera(cameras, name) for name in (distance.first, distance.second))
    distance_in_units = float(np.linalg.norm(_camera_center(first) - _camera_center(second)))
    if distance_in_units < 1e-9:
        message = f"cameras {distance.first} and {distance.second} are at the same position"
        raise CalibrationError(message)
    return distance.meters / distance_in_units


def _transform_camera(
    camera: CalibratedCamera, rotation: Float64Array, origin: Float64Array, scale: float
) -> CalibratedCamera:
    axes = rotation @ camera.pose.rotation.T
    center = scale * (rotation @ (_camera_center(camera) - origin))
    return CalibratedCamera(camera.name, camera.lens, make_pose(axes, center))


def _find_camera(cameras: Sequence[CalibratedCamera], name: str) -> CalibratedCamera:
    for camera in cameras:
        if camera.name == name:
            return camera
    names = ", ".join(camera.name for camera in cameras)
    message = f"camera {name} was not calibrated; the calibrated cameras are {names}"
    raise UnknownCameraError(message)


def _camera_center(camera: CalibratedCamera) -> Float64Array:
    return np.asarray(-camera.pose.rotation.T @ camera.pose.translation)
