"""Computes rotation matrices, centers and projections of pinhole cameras in float64."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.cameras import Camera

Float64Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PointProjection:
    """Points projected into a camera's picture.

    Attributes:
        columns: `[P]` horizontal position, pixels; undefined behind the camera.
        rows: `[P]` vertical position, pixels; undefined behind the camera.
        depths: `[P]` distance along the optical axis, world units; 0 or less behind the camera.
        is_visible: `[P]` whether a point is in front of the camera and inside its picture.
    """

    columns: Float64Array
    rows: Float64Array
    depths: Float64Array
    is_visible: NDArray[np.bool_]


def rotation_matrix(camera: Camera) -> Float64Array:
    """Return the `[3, 3]` rotation from world to camera."""
    return np.array(camera.rotation, dtype=np.float64).reshape(3, 3)


def camera_center(camera: Camera) -> Float64Array:
    """Return the `[3]` position of a camera in world units."""
    center: Float64Array = -rotation_matrix(camera).T @ np.array(camera.translation)
    return center


def project_points(camera: Camera, positions: NDArray[np.floating]) -> PointProjection:
    """Project points into a camera's picture.

    Args:
        camera: A pinhole camera.
        positions: `[P, 3]` points, world units.
    """
    rotated_positions = positions.astype(np.float64) @ rotation_matrix(camera).T
    x, y, depths = (rotated_positions + np.array(camera.translation)).T
    is_in_front = depths > 0
    divisors = np.where(is_in_front, depths, 1.0)
    columns = camera.fx * x / divisors + camera.cx
    rows = camera.fy * y / divisors + camera.cy
    is_inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    return PointProjection(columns, rows, depths, is_in_front & is_inside)
