"""Where points of the scene fall in the pictures of cameras."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.cameras import Camera

_POINTS_PER_CELL = 2
_AS_NEAR = 1.05  # depths that differ by less are of one surface


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """Points as one camera projects them.

    Attributes:
        columns: `[P]` pixels; without meaning behind the camera.
        rows: `[P]` pixels, likewise.
        depths: `[P]` world units; 0 or less behind the camera.
        within: `[P]` whether the point is in front of the camera and inside its picture.
    """

    columns: NDArray[np.float64]
    rows: NDArray[np.float64]
    depths: NDArray[np.float64]
    within: NDArray[np.bool_]


def sight_points(camera: Camera, positions: NDArray[np.floating]) -> Sighting:
    """Return where a camera sees points.

    Args:
        camera: A pinhole.
        positions: `[P, 3]` world units.
    """
    rotation = np.array(camera.rotation).reshape(3, 3)
    x, y, depths = (positions.astype(np.float64) @ rotation.T + np.array(camera.translation)).T
    ahead = depths > 0
    divisors = np.where(ahead, depths, 1.0)
    columns = camera.fx * x / divisors + camera.cx
    rows = camera.fy * y / divisors + camera.cy
    inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    return Sighting(columns, rows, depths, ahead & inside)


def drop_hidden(camera: Camera, sighting: Sighting) -> NDArray[np.intp]:
    """Return the indices of the points that no other point hides from a camera.

    Of the points that fall into one cell of the picture, the nearest are kept. Cells
    are small, so that a stray point before the camera hides few others.
    """
    seen = np.flatnonzero(sighting.within)
    if not seen.size:
        return seen
    side = max(1.0, (camera.width * camera.height * _POINTS_PER_CELL / seen.size) ** 0.5)
    across = int(camera.width // side) + 1
    cells = (sighting.rows[seen] // side).astype(np.int64) * across
    cells += (sighting.columns[seen] // side).astype(np.int64)
    nearest = np.full(int(cells.max()) + 1, np.inf)
    np.minimum.at(nearest, cells, sighting.depths[seen])
    shown: NDArray[np.intp] = seen[sighting.depths[seen] <= _AS_NEAR * nearest[cells]]
    return shown


def find_center(camera: Camera) -> NDArray[np.float64]:
    """Return `[3]` where a camera is, world units."""
    rotation = np.array(camera.rotation).reshape(3, 3)
    center: NDArray[np.float64] = -rotation.T @ np.array(camera.translation)
    return center
