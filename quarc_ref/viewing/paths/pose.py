"""Position and orientation of a moving camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.cameras import Camera

Vector = NDArray[np.float64]
_LEAST_LENGTH = 1e-9
_DISTANCE = 4.0  # to what a lone camera looks at, times its near bound
_STRAIGHT = 1e-3  # how far rays differ in direction where they meet somewhere


class PathError(ValueError):
    """A camera path that cannot be followed."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture of a path.

    Attributes:
        frame: Ordinal of the stream's frame that is seen.
        camera: Camera that sees it.
    """

    frame: int
    camera: Camera


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A place and a direction.

    Attributes:
        eye: `[3]` world units.
        axes: `[3, 3]` rows right, down and forward: the rotation from world to camera.
        view_angle: From the lower to the upper border, radians.
    """

    eye: Vector
    axes: Vector
    view_angle: float

    def as_camera(self, like: Camera) -> Camera:
        """Return a camera in this pose with the pictures of another one."""
        focal = like.height / 2 / math.tan(self.view_angle / 2)
        return replace(
            like,
            name="path",
            fx=focal * like.fx / like.fy,
            fy=focal,
            rotation=tuple(self.axes.ravel().tolist()),
            translation=tuple((-self.axes @ self.eye).tolist()),
        )


def pose_of(camera: Camera) -> Pose:
    """Return the pose of a camera."""
    axes = np.array(camera.rotation, dtype=np.float64).reshape(3, 3)
    eye = -axes.T @ np.array(camera.translation, dtype=np.float64)
    return Pose(eye, axes, 2 * math.atan(camera.height / 2 / camera.fy))


def look_at(eye: Vector, target: Vector, up: Vector, view_angle: float) -> Pose:
    """Return the pose that looks from one place to another, level with the horizon.

    Raises:
        PathError: The places are the same, or one is right above the other.
    """
    forward = _normalize(target - eye, "the position and the target of a camera are the same point")
    right = _normalize(np.cross(forward, up), "a camera looks straight up or down")
    return Pose(eye, np.stack([right, np.cross(forward, right), forward]), view_angle)


def find_up(cameras: Sequence[Camera], up_axis: int) -> Vector:
    """Return `[3]` the direction up.

    Args:
        cameras: Cameras of the stream.
        up_axis: From the stream's header; if it is 0 (unknown), cameras are assumed to be level on
            average.
    """
    if up_axis:
        axis, is_negative = divmod(up_axis - 1, 2)
        toward: Vector = np.eye(3)[axis] * (-1 if is_negative else 1)
        return toward
    total = -sum((pose_of(camera).axes[1] for camera in cameras), np.zeros(3))
    return _normalize(
        total, "the stream does not state an up axis, and its cameras do not agree on one"
    )


def find_center(cameras: Sequence[Camera]) -> Vector:
    """Return `[3]` the point that is nearest to the viewing axes of all cameras.

    If these do not meet, it is in front of the first camera.
    """
    poses = [pose_of(camera) for camera in cameras]
    normal = sum((np.eye(3) - np.outer(it.axes[2], it.axes[2]) for it in poses), np.zeros((3, 3)))
    if np.linalg.eigvalsh(normal)[0] < _STRAIGHT * len(poses):
        first = poses[0]
        before: Vector = first.eye + _DISTANCE * cameras[0].near * first.axes[2]
        return before
    offsets = [it.eye - (it.axes[2] @ it.eye) * it.axes[2] for it in poses]
    center: Vector = np.linalg.solve(normal, sum(offsets, np.zeros(3)))
    return center


def _normalize(vector: Vector, fault: str) -> Vector:
    length = float(np.linalg.norm(vector))
    if length < _LEAST_LENGTH:
        raise PathError(fault)
    unit: Vector = vector / length
    return unit
