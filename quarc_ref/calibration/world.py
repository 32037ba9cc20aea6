"""Defines the up axis, origin and unit of the world of a rig.

The orientation, origin and scale of the solver's world are arbitrary. The resulting world
has up along -y, as in COLMAP and most 3DGS files; the first camera looks along +z; the
origin is the point that the cameras look at; and the unit is a meter, or the mean
distance of the cameras from the origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.calibration.errors import CalibrationError, UnknownCameraError
from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array, make_pose

BY_LEVEL = "level"
BY_PLANE = "plane"
UP = (0.0, -1.0, 0.0)
_MIN_SPREAD = 0.02  # minimum mean squared sine: level cameras must look in different directions
_MIN_FOR_PLANE = 4
_FLAT = 0.3  # maximum ratio of thickness to width of a rig that lies in a plane
_PARALLEL = 1e-3  # smallest eigenvalue per camera below which optical axes count as parallel


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
    """A rig in its final world.

    Attributes:
        cameras: Cameras in this world.
        up: Up direction.
        up_from: Human-readable source of the up direction.
        meters_per_unit: None if no distance is known.
    """

    cameras: tuple[CalibratedCamera, ...]
    up: tuple[float, float, float]
    up_from: str
    meters_per_unit: float | None


def define_world(
    cameras: Sequence[CalibratedCamera],
    points: Float64Array,
    up: str = BY_LEVEL,
    distance: Distance | None = None,
) -> World:
    """Transform a rig into an upright world.

    Args:
        cameras: Cameras in the world of the solver.
        points: `[P, 3]` scene points in the same world.
        up: `level` if the cameras are level, `plane` if they lie in a horizontal plane,
            or the name of a level camera.
        distance: Distance between two cameras; None if unknown.

    Raises:
        CalibrationError: The cameras do not lie in a plane, or two are at the same position.
        UnknownCameraError: A named camera has no pose.
    """
    direction, up_from = _find_up(cameras, up)
    forward = cameras[0].pose.rotation[2]
    forward = forward - (forward @ direction) * direction
    if np.linalg.norm(forward) < _PARALLEL:  # the camera looks straight down, or up
        forward = np.cross(cameras[0].pose.rotation[0], direction)
    forward /= np.linalg.norm(forward)
    turn = np.stack([np.cross(-direction, forward), -direction, forward])
    origin = _find_focus(cameras, points)
    scale = _find_scale(cameras, origin, distance)
    return World(
        tuple(_move(camera, turn, origin, scale) for camera in cameras),
        UP,
        up_from,
        None if distance is None else 1.0,
    )


def _find_up(cameras: Sequence[CalibratedCamera], up: str) -> tuple[Float64Array, str]:
    mean = -np.mean([camera.pose.rotation[1] for camera in cameras], axis=0)
    if up == BY_LEVEL:
        return _find_level(cameras, mean)
    if up == BY_PLANE:
        return _find_plane(cameras, mean), "the plane of the cameras"
    return -_find(cameras, up).pose.rotation[1], f"camera {up}, which is level"


def _find_level(
    cameras: Sequence[CalibratedCamera], mean: Float64Array
) -> tuple[Float64Array, str]:
    """Return the direction to which the horizontal axes of all pictures are perpendicular."""
    rights = np.array([camera.pose.rotation[0] for camera in cameras])
    values, vectors = np.linalg.eigh(rights.T @ rights / len(cameras))
    if values[1] < _MIN_SPREAD:  # all point in one direction: any roll is possible
        return mean / np.linalg.norm(mean), "the mean of cameras that point in one direction"
    axis = vectors[:, 0]
    return np.asarray(axis if axis @ mean >= 0 else -axis), "cameras that are level"


def _find_plane(cameras: Sequence[CalibratedCamera], mean: Float64Array) -> Float64Array:
    places = np.array([_center(camera) for camera in cameras])
    _, spreads, axes = np.linalg.svd(places - places.mean(axis=0))
    if len(cameras) < _MIN_FOR_PLANE or spreads[2] > _FLAT * spreads[1]:
        message = (
            "the cameras do not lie in one plane that could define the up axis: omit --up if "
            "the cameras are level, or give it the name of a level camera"
        )
        raise CalibrationError(message)
    return np.asarray(axes[2] if axes[2] @ mean >= 0 else -axes[2])


def _find_focus(cameras: Sequence[CalibratedCamera], points: Float64Array) -> Float64Array:
    """Return the point nearest to all lines of sight; the scene's center if they are parallel."""
    total, weighted = np.zeros((3, 3)), np.zeros(3)
    for camera in cameras:
        sight = camera.pose.rotation[2]
        across = np.eye(3) - np.outer(sight, sight)
        total += across
        weighted += across @ _center(camera)
    middle = np.median(points, axis=0)
    if np.linalg.eigvalsh(total)[0] < _PARALLEL * len(cameras):
        return np.asarray(middle)
    focus = np.linalg.solve(total, weighted)
    is_seen = all(
        camera.pose.rotation[2] @ focus + camera.pose.translation[2] > 0 for camera in cameras
    )
    return np.asarray(focus if is_seen else middle)


def _find_scale(
    cameras: Sequence[CalibratedCamera], origin: Float64Array, distance: Distance | None
) -> float:
    if distance is None:
        return 1 / float(np.mean([np.linalg.norm(_center(camera) - origin) for camera in cameras]))
    first, second = (_find(cameras, name) for name in (distance.first, distance.second))
    found = float(np.linalg.norm(_center(first) - _center(second)))
    if found < 1e-9:
        message = f"cameras {distance.first} and {distance.second} are at the same position"
        raise CalibrationError(message)
    return distance.meters / found


def _move(
    camera: CalibratedCamera, turn: Float64Array, origin: Float64Array, scale: float
) -> CalibratedCamera:
    axes = turn @ camera.pose.rotation.T
    center = scale * (turn @ (_center(camera) - origin))
    return CalibratedCamera(camera.name, camera.lens, make_pose(axes, center))


def _find(cameras: Sequence[CalibratedCamera], name: str) -> CalibratedCamera:
    for camera in cameras:
        if camera.name == name:
            return camera
    joined = ", ".join(camera.name for camera in cameras)
    message = f"camera {name} was not calibrated; the calibrated cameras are {joined}"
    raise UnknownCameraError(message)


def _center(camera: CalibratedCamera) -> Float64Array:
    return np.asarray(-camera.pose.rotation.T @ camera.pose.translation)
