"""Plans camera paths from the cameras of a stream."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.paths.interpolation import interpolate_poses
from quarc_ref.viewing.paths.pose import (
    Pose,
    Vector,
    WorldAxes,
    find_center,
    find_up,
    get_camera_pose,
    look_at,
)

_SPIRAL_TURNS = 2
_SPIRAL_EXTENT_FACTOR = 0.5  # relative to the largest distance of a camera from the mean position


def plan_orbit(
    cameras: Sequence[Camera], first_camera: Camera, axes: WorldAxes, pose_count: int
) -> list[Pose]:
    """Plan a circle at constant height around the point that the cameras look at.

    Args:
        cameras: Cameras of the stream.
        first_camera: Camera at which the circle starts.
        axes: Axes of the stream.
        pose_count: Number of poses, evenly spaced on the closed circle.

    Raises:
        PathError: The up direction is unknown, or the first camera is vertically above or
            below the center.
    """
    up, center, first_pose = (
        find_up(cameras, axes),
        find_center(cameras),
        get_camera_pose(first_camera),
    )
    offset = first_pose.eye - center
    vertical_offset = (offset @ up) * up
    horizontal_offset = offset - vertical_offset
    tangent = np.cross(up, horizontal_offset) * (1 if axes.right_handed else -1)
    return [
        look_at(
            center
            + vertical_offset
            + math.cos(angle) * horizontal_offset
            + math.sin(angle) * tangent,
            center,
            up,
            first_pose.view_angle,
            right_handed=axes.right_handed,
        )
        for angle in (2 * math.pi * index / pose_count for index in range(pose_count))
    ]


def plan_spiral(
    cameras: Sequence[Camera], first_camera: Camera, axes: WorldAxes, pose_count: int
) -> list[Pose]:
    """Plan a spiral in front of a forward-facing scene; all poses look at the scene's center.

    Args:
        cameras: Cameras of the stream.
        first_camera: Camera whose field of view is used.
        axes: Axes of the stream.
        pose_count: Number of poses.

    Raises:
        PathError: The up direction is unknown.
    """
    up, center = find_up(cameras, axes), find_center(cameras)
    eyes = np.array([get_camera_pose(camera).eye for camera in cameras])
    mean_eye = eyes.mean(axis=0)
    view_axes = look_at(mean_eye, center, up, 1.0, right_handed=axes.right_handed).axes
    extent = _SPIRAL_EXTENT_FACTOR * np.abs((eyes - mean_eye) @ view_axes.T).max(axis=0)
    poses = []
    for index in range(pose_count):
        angle = 2 * math.pi * _SPIRAL_TURNS * index / pose_count
        direction: Vector = np.array([math.cos(angle), math.sin(angle), math.sin(angle / 2)])
        poses.append(
            look_at(
                mean_eye + (extent * direction) @ view_axes,
                center,
                up,
                get_camera_pose(first_camera).view_angle,
                right_handed=axes.right_handed,
            )
        )
    return poses


def plan_tour(
    cameras: Sequence[Camera], first_camera: Camera, _axes: WorldAxes, pose_count: int
) -> list[Pose]:
    """Plan a smooth path through all cameras, from each camera to the nearest remaining one.

    Args:
        cameras: Cameras of the stream.
        first_camera: Camera at which the path starts.
        pose_count: Number of poses, including the pose of the last camera.

    Raises:
        PathError: The rotation of a camera is a singular matrix.
    """
    remaining_poses = [
        get_camera_pose(camera) for camera in cameras if camera.name != first_camera.name
    ]
    tour_poses = [get_camera_pose(first_camera)]
    while remaining_poses:
        distances = [
            float(np.linalg.norm(pose.eye - tour_poses[-1].eye)) for pose in remaining_poses
        ]
        tour_poses.append(remaining_poses.pop(int(np.argmin(distances))))
    lengths = [float(np.linalg.norm(end.eye - start.eye)) for start, end in pairwise(tour_poses)]
    # Splines need increasing times, even if two cameras have the same position.
    min_length = max(sum(lengths) * 1e-3, 1e-6)
    times = np.concatenate([[0.0], np.cumsum(np.maximum(lengths, min_length))])
    return interpolate_poses(times, tour_poses, np.linspace(0, times[-1], pose_count))


PATH_PLANNERS: dict[str, Callable[[Sequence[Camera], Camera, WorldAxes, int], list[Pose]]] = {
    "orbit": plan_orbit,
    "spiral": plan_spiral,
    "interpolate": plan_tour,
}
