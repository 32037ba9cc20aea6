"""Position and orientation of a moving camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.cameras import Camera

Vector = NDArray[np.float64]
_MIN_LENGTH = 1e-9
# assumed distance of the center for a single camera, in multiples of its near plane
_DISTANCE = 4.0
_STRAIGHT = 1e-3  # minimum difference in direction of rays that intersect


class PathError(ValueError):
    """A camera path is invalid."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture of a path.

    Attributes:
        frame: Ordinal of the frame.
        camera: The camera.
    """

    frame: int
    camera: Camera


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A position and an orientation.

    Attributes:
        eye: `[3]` position, world units.
        axes: `[3, 3]` rotation from world to camera; its rows are right, down and forward.
        view_angle: Vertical field of view, radians.
    """

    eye: Vector
    axes: Vector
    view_angle: float

    def as_camera(self, like: Camera) -> Camera:
        """Return a camera with this pose and the picture size of another camera."""
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
    """Return the pose that looks from one position to another without roll.

    Raises:
        PathError: The positions are equal, or one is vertically above the other.
    """
    forward = _normalize(target - eye, "the position and the target of a camera are the same point")
    right = _normalize(np.cross(forward, up), "a camera looks straight up or down")
    return Pose(eye, np.stack([right, np.cross(forward, right), forward]), view_angle)


def find_up(cameras: Sequence[Camera], up_axis: int) -> Vector:
    """Return the `[3]` up direction.

    Args:
        cameras: Cameras of the stream.
        up_axis: Up axis from the stream's header; if it is 0 (unknown), cameras are
            assumed to be level on average.
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
    """Return the `[3]` point that is nearest to the viewing axes of all cameras.

    If the axes are parallel, the point is in front of the first camera.
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
    if length < _MIN_LENGTH:
        raise PathError(fault)
    unit: Vector = vector / length
    return unit
