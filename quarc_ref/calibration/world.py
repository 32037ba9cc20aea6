"""Which way is up in the world of a rig, where its origin is, and how long a unit.

A solver's world is turned, placed and scaled by chance. The resulting world has up along -y, as in
the frame of COLMAP and of most 3DGS files; the first camera looks along +z; the origin is the
point that the cameras look at; and the unit is a meter, or the mean distance of the cameras from
the origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.calibration.errors import CalibrationError, UnknownCameraError
from quarc_ref.datasets.calibration import CalibratedCamera, Numbers, make_pose

BY_LEVEL = "level"
BY_PLANE = "plane"
UP = (0.0, -1.0, 0.0)
_LEAST_SPREAD = 0.02  # of squared sines: level cameras must look in different directions
_LEAST_FOR_PLANE = 4
_FLAT = 0.3  # greatest ratio of thickness and width of a rig that lies in a plane
_PARALLEL = 1e-3  # of the smallest eigenvalue: axes that do not meet


@dataclass(frozen=True, slots=True)
class Distance:
    """The distance of two cameras.

    Attributes:
        first: Name of a camera.
        second: Name of another.
        meters: Between them.
    """

    first: str
    second: str
    meters: float


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """The rig in its own world.

    Attributes:
        cameras: As they stand in it.
        up: Where up is in it.
        up_from: Human-readable source of the up direction.
        meters_per_unit: None if no distance is known.
    """

    cameras: tuple[CalibratedCamera, ...]
    up: tuple[float, float, float]
    up_from: str
    meters_per_unit: float | None


def settle_world(
    cameras: Sequence[CalibratedCamera],
    points: Numbers,
    up: str = BY_LEVEL,
    distance: Distance | None = None,
) -> World:
    """Return the rig in an upright world.

    Args:
        cameras: In the world of the solver.
        points: `[P, 3]` of the scene in the same world.
        up: `level` if the cameras are level, `plane` if they are in one level plane, or the name
            of a level camera.
        distance: Distance of two cameras; None if unknown.

    Raises:
        CalibrationError: The cameras are not in a plane, or two are at the same place.
        UnknownCameraError: A camera that is named has no pose.
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


def _find_up(cameras: Sequence[CalibratedCamera], up: str) -> tuple[Numbers, str]:
    mean = -np.mean([camera.pose.rotation[1] for camera in cameras], axis=0)
    if up == BY_LEVEL:
        return _find_level(cameras, mean)
    if up == BY_PLANE:
        return _find_plane(cameras, mean), "the plane of the cameras"
    return -_find(cameras, up).pose.rotation[1], f"camera {up}, which stands level"


def _find_level(cameras: Sequence[CalibratedCamera], mean: Numbers) -> tuple[Numbers, str]:
    """Return the direction to which the horizontal axes of all pictures are perpendicular."""
    rights = np.array([camera.pose.rotation[0] for camera in cameras])
    values, vectors = np.linalg.eigh(rights.T @ rights / len(cameras))
    if values[1] < _LEAST_SPREAD:  # all look the same way: any roll would do
        return mean / np.linalg.norm(mean), "the mean of the cameras, which look the same way"
    axis = vectors[:, 0]
    return np.asarray(axis if axis @ mean >= 0 else -axis), "cameras that stand level"


def _find_plane(cameras: Sequence[CalibratedCamera], mean: Numbers) -> Numbers:
    places = np.array([_center(camera) for camera in cameras])
    _, spreads, axes = np.linalg.svd(places - places.mean(axis=0))
    if len(cameras) < _LEAST_FOR_PLANE or spreads[2] > _FLAT * spreads[1]:
        message = (
            "the cameras are not in one plane that could define up: leave out --up "
            "if they stand level, or name one that does"
        )
        raise CalibrationError(message)
    return np.asarray(axes[2] if axes[2] @ mean >= 0 else -axes[2])


def _find_focus(cameras: Sequence[CalibratedCamera], points: Numbers) -> Numbers:
    """Return the point nearest to all lines of sight; of parallel ones, the middle of the scene."""
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
    cameras: Sequence[CalibratedCamera], origin: Numbers, distance: Distance | None
) -> float:
    if distance is None:
        return 1 / float(np.mean([np.linalg.norm(_center(camera) - origin) for camera in cameras]))
    first, second = (_find(cameras, name) for name in (distance.first, distance.second))
    found = float(np.linalg.norm(_center(first) - _center(second)))
    if found < 1e-9:
        message = f"cameras {distance.first} and {distance.second} are in one place"
        raise CalibrationError(message)
    return distance.meters / found


def _move(
    camera: CalibratedCamera, turn: Numbers, origin: Numbers, scale: float
) -> CalibratedCamera:
    axes = turn @ camera.pose.rotation.T
    center = scale * (turn @ (_center(camera) - origin))
    return CalibratedCamera(camera.name, camera.lens, make_pose(axes, center))


def _find(cameras: Sequence[CalibratedCamera], name: str) -> CalibratedCamera:
    for camera in cameras:
        if camera.name == name:
            return camera
    joined = ", ".join(camera.name for camera in cameras)
    message = f"there is no camera {name} that joined; those are {joined}"
    raise UnknownCameraError(message)


def _center(camera: CalibratedCamera) -> Numbers:
    return np.asarray(-camera.pose.rotation.T @ camera.pose.translation)
