"""Where a viewer stands: cameras of a stream as orbits of a page have them.

An orbit turns about a point, with an axis that points up. A camera has neither:
the point is put where the scene is, and up is what the stream says or, if it
does not, what its cameras share. The axis is turned no further than it takes
for the picture to stand as the camera's does.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import NEAR_FRACTION

Vector = NDArray[np.float64]

_FAR = 1e4
_LEAST_COSINE = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Vantage:
    """A place to look from.

    Attributes:
        position: `[3]` world units.
        target: `[3]` in the middle of the view, world units.
        up: `[3]` axis of the orbit.
        view_angle: From the lower to the upper border, radians.
        near: World units.
        far: World units.
    """

    position: Vector
    target: Vector
    up: Vector
    view_angle: float
    near: float
    far: float


def find_up(cameras: Sequence[Camera], up_axis: int) -> Vector:
    """Return `[3]` the direction up.

    Args:
        cameras: Of the stream.
        up_axis: From the stream's header; 0 is unknown.
    """
    if up_axis:
        axis, is_negative = divmod(up_axis - 1, 2)
        toward: Vector = np.eye(3)[axis] * (-1 if is_negative else 1)
        return toward
    total: Vector = -sum((_rotation(camera)[1] for camera in cameras), np.zeros(3))
    length = float(np.linalg.norm(total))
    return total / length if length > _LEAST_COSINE else np.array([0.0, 0.0, 1.0])


def stand_at(camera: Camera, up: Vector, positions: NDArray[np.float32]) -> Vantage:
    """Return where a camera stands.

    Args:
        camera: Of the stream.
        up: From `find_up`.
        positions: `[N, 3]` Gaussians, world units.
    """
    right, down, forward = _rotation(camera)
    eye = -_rotation(camera).T @ np.array(camera.translation)
    level: Vector = up - (up @ right) * right
    if level @ -down < _LEAST_COSINE:  # the camera hangs upside down
        level = -down
    return Vantage(
        eye,
        eye + forward * _typical_depth(camera, positions),
        level / np.linalg.norm(level),
        2 * math.atan(camera.height / 2 / camera.fy),
        NEAR_FRACTION * camera.near,
        _FAR * camera.near,
    )


def _typical_depth(camera: Camera, positions: NDArray[np.float32]) -> float:
    """Return the median depth of the Gaussians that a camera sees; of none, twice the least."""
    x, y, z = _rotation(camera) @ positions.T + np.array(camera.translation)[:, None]
    across, down = np.abs(x) * camera.fx, np.abs(y) * camera.fy
    seen = (z > camera.near) & (across < z * camera.width / 2) & (down < z * camera.height / 2)
    return float(np.median(z[seen])) if seen.any() else 2 * camera.near


def _rotation(camera: Camera) -> Vector:
    return np.array(camera.rotation).reshape(3, 3)
