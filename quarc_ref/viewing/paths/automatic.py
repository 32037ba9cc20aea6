"""Paths computed from the cameras of a stream."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.paths.interpolation import interpolate_poses
from quarc_ref.viewing.paths.pose import (
    Pose,
    Vector,
    find_center,
    find_up,
    look_at,
    pose_of,
)

_SPIRAL_TURNS = 2
_SPIRAL_REACH = 0.5  # relative to the distance of cameras from their center


def orbit(cameras: Sequence[Camera], first: Camera, up_axis: int, count: int) -> list[Pose]:
    """Return a circle at constant height around the point that the cameras look at.

    Args:
        cameras: Cameras of the stream.
        first: Camera at which the circle starts.
        up_axis: Up axis from the stream's header.
        count: Number of poses, evenly spaced on the closed circle.

    Raises:
        PathError: The up direction is unknown, or the first camera is vertically above or
            below the center.
    """
    up, center, begin = find_up(cameras, up_axis), find_center(cameras), pose_of(first)
    offset = begin.eye - center
    height = (offset @ up) * up
    radius = offset - height
    aside = np.cross(up, radius)
    return [
        look_at(
            center + height + math.cos(angle) * radius + math.sin(angle) * aside,
            center,
            up,
            begin.view_angle,
        )
        for angle in (2 * math.pi * place / count for place in range(count))
    ]


def spiral(cameras: Sequence[Camera], first: Camera, up_axis: int, count: int) -> list[Pose]:
    """Return a spiral for a forward-facing rig, which looks at the center of the scene.

    Args:
        cameras: Cameras of the stream.
        first: Camera whose angle of view is used.
        up_axis: Up axis from the stream's header.
        count: Number of poses.

    Raises:
        PathError: The up direction is unknown.
    """
    up, center = find_up(cameras, up_axis), find_center(cameras)
    eyes = np.array([pose_of(camera).eye for camera in cameras])
    middle = eyes.mean(axis=0)
    axes = look_at(middle, center, up, 1.0).axes
    reach = _SPIRAL_REACH * np.abs((eyes - middle) @ axes.T).max(axis=0)
    poses = []
    for place in range(count):
        angle = 2 * math.pi * _SPIRAL_TURNS * place / count
        turn: Vector = np.array([math.cos(angle), math.sin(angle), math.sin(angle / 2)])
        poses.append(look_at(middle + (reach * turn) @ axes, center, up, pose_of(first).view_angle))
    return poses


def tour(cameras: Sequence[Camera], first: Camera, _up_axis: int, count: int) -> list[Pose]:
    """Return a smooth path through all cameras, from each to the nearest remaining one.

    Args:
        cameras: Cameras of the stream.
        first: Camera at which the path starts.
        count: Number of poses; the last one is that of the last camera.
    """
    left = [pose_of(camera) for camera in cameras if camera.name != first.name]
    stops = [pose_of(first)]
    while left:
        distances = [float(np.linalg.norm(it.eye - stops[-1].eye)) for it in left]
        stops.append(left.pop(int(np.argmin(distances))))
    lengths = [float(np.linalg.norm(b.eye - a.eye)) for a, b in pairwise(stops)]
    # Splines need increasing times, also for cameras at the same position.
    least = max(sum(lengths) * 1e-3, 1e-6)
    times = np.concatenate([[0.0], np.cumsum(np.maximum(lengths, least))])
    return interpolate_poses(times, stops, np.linspace(0, times[-1], count))


PATHS: dict[str, Callable[[Sequence[Camera], Camera, int, int], list[Pose]]] = {
    "orbit": orbit,
    "spiral": spiral,
    "interpolate": tour,
}
