"""Computes rotation matrices, centers and projections of pinhole cameras in float64."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.cameras import Camera

Float64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PointProjection:
    """Points projected into a camera's picture.

    Attributes:
        columns: `[P]` horizontal position, pixels; undefined behind the camera.
        rows: `[P]` vertical position, pixels; undefined behind the camera.
        depths: `[P]` distance along the optical axis, world units; 0 or less behind the camera.
        within: `[P]` whether a point is in front of the camera and inside its picture.
    """

    columns: Float64
    rows: Float64
    depths: Float64
    within: NDArray[np.bool_]


def rotation_matrix(camera: Camera) -> Float64:
    """Return the `[3, 3]` rotation from world to camera."""
    return np.array(camera.rotation, dtype=np.float64).reshape(3, 3)


def camera_center(camera: Camera) -> Float64:
    """Return the `[3]` position of a camera in world units."""
    center: Float64 = -rotation_matrix(camera).T @ np.array(camera.translation)
    return center


def project_points(camera: Camera, positions: NDArray[np.floating]) -> PointProjection:
    """Project points into a camera's picture.

    Args:
        camera: A pinhole camera.
        positions: `[P, 3]` points, world units.
    """
    in_camera = positions.astype(np.float64) @ rotation_matrix(camera).T
    x, y, depths = (in_camera + np.array(camera.translation)).T
    is_ahead = depths > 0
    divisors = np.where(is_ahead, depths, 1.0)
    columns = camera.fx * x / divisors + camera.cx
    rows = camera.fy * y / divisors + camera.cy
    inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    return PointProjection(columns, rows, depths, is_ahead & inside)
