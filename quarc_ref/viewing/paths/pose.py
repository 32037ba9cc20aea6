"""Position and orientation of a moving camera."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.export.up_direction import find_up_direction
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import StreamHeader

Vector = NDArray[np.float64]
_MIN_LENGTH = 1e-9
# assumed distance from a camera to the center of the scene, in multiples of its near plane
_CENTER_DISTANCE_FACTOR = 4.0
# optical axes count as parallel if smallest eigenvalue / number of cameras is below this
_PARALLEL_LIMIT = 1e-3


class PathError(ValueError):
    """A camera path is invalid."""


@dataclass(frozen=True, slots=True)
class PlannedPicture:
    """A picture that is to be rendered.

    Attributes:
        frame: Ordinal of the frame.
        camera: Camera for which the frame is rendered.
        share: Share of the way to the next frame, from 0 to below 1.
    """

    frame: int
    camera: Camera
    share: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class WorldAxes:
    """What a stream states about the axes of its world.

    Attributes:
        up: `[3]` up direction, a unit vector; None if it is unknown.
        right_handed: Whether the world is right-handed.
    """

    up: Vector | None = None
    right_handed: bool = True

    @classmethod
    def from_stream(cls, header: StreamHeader, metadata: Mapping[str, str]) -> "WorldAxes":
        """Return the axes from a stream's header and, if it has no up axis, metadata (SPEC I.4)."""
        up = find_up_direction(header.up_axis, metadata)
        if up is not None:
            up = up / np.abs(up).max()  # the square of a tiny or huge number is out of range
            up = up / np.linalg.norm(up)
        return cls(up, header.right_handed)


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A position and an orientation.

    Attributes:
        eye: `[3]` position, world units.
        axes: `[3, 3]` matrix from world to camera; its rows point right, down and forward. It is
            a rotation, combined with a reflection in a left-handed world.
        view_angle: Vertical field of view, radians.
    """

    eye: Vector
    axes: NDArray[np.float64]
    view_angle: float

    def as_camera(self, reference_camera: Camera) -> Camera:
        """Return a camera with this pose and the picture size of another camera."""
        focal_length = reference_camera.height / 2 / math.tan(self.view_angle / 2)
        return replace(
            reference_camera,
            name="path",
            fx=focal_length * reference_camera.fx / reference_camera.fy,
            fy=focal_length,
            rotation=tuple(self.axes.ravel().tolist()),
            translation=tuple((-self.axes @ self.eye).tolist()),
        )


def get_camera_pose(camera: Camera) -> Pose:
    """Return the pose of a camera."""
    axes = np.array(camera.rotation, dtype=np.float64).reshape(3, 3)
    eye = -axes.T @ np.array(camera.translation, dtype=np.float64)
    return Pose(eye, axes, 2 * math.atan(camera.height / 2 / camera.fy))


def look_at(
    eye: Vector, target: Vector, up: Vector, view_angle: float, *, right_handed: bool = True
) -> Pose:
    """Return the pose of a camera at `eye` that looks at `target` without roll.

    Args:
        eye: `[3]` position.
        target: `[3]` point to look at.
        up: `[3]` up direction of the scene.
        view_angle: Vertical field of view, radians.
        right_handed: Whether the world is right-handed. In a left-handed world, a cross product
            points to the opposite side, so the axes contain a reflection (SPEC 5.6).

    Raises:
        PathError: The two positions are equal, or the camera would look straight up or down.
    """
    forward = _normalize(target - eye, "the position and the target of a camera are the same point")
    right = _normalize(np.cross(forward, up), "a camera looks straight up or down")
    down = np.cross(forward, right)
    return Pose(eye, np.stack([right if right_handed else -right, down, forward]), view_angle)


def find_up(cameras: Sequence[Camera], axes: WorldAxes) -> Vector:
    """Return the `[3]` up direction of the scene.

    Args:
        cameras: Cameras of the stream; if it states no up direction, they are assumed to be level
            on average.
        axes: Axes of the stream.

    Raises:
        PathError: The up direction is unknown.
    """
    if axes.up is not None:
        return axes.up
    mean_up = -sum((get_camera_pose(camera).axes[1] for camera in cameras), np.zeros(3))
    return _normalize(
        mean_up, "the stream has no up direction, and the up directions of its cameras cancel out"
    )


def find_center(cameras: Sequence[Camera]) -> Vector:
    """Return the `[3]` point that is nearest to the optical axes of all cameras.

    If the optical axes are parallel, the point is in front of the first camera.
    """
    poses = [get_camera_pose(camera) for camera in cameras]
    normal_matrix = sum(
        (np.eye(3) - np.outer(pose.axes[2], pose.axes[2]) for pose in poses), np.zeros((3, 3))
    )
    if np.linalg.eigvalsh(normal_matrix)[0] < _PARALLEL_LIMIT * len(poses):
        first_pose = poses[0]
        center_ahead: Vector = (
            first_pose.eye + _CENTER_DISTANCE_FACTOR * cameras[0].near * first_pose.axes[2]
        )
        return center_ahead
    offsets = [pose.eye - (pose.axes[2] @ pose.eye) * pose.axes[2] for pose in poses]
    center: Vector = np.linalg.solve(normal_matrix, sum(offsets, np.zeros(3)))
    return center


def _normalize(vector: Vector, message: str) -> Vector:
    length = float(np.linalg.norm(vector))
    if length < _MIN_LENGTH:
        raise PathError(message)
    unit: Vector = vector / length
    return unit
