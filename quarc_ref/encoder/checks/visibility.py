"""Determines which projected points are visible."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.format.cameras import Camera

_POINTS_PER_CELL = 2
_SAME_SURFACE = 1.05  # depths with a smaller ratio belong to the same surface


def drop_hidden(camera: Camera, projection: PointProjection) -> NDArray[np.intp]:
    """Return the indices of the points that no other point occludes.

    Only the nearest points in each cell of the picture are kept. Cells are small, so that
    a stray point in front of the camera occludes few others.
    """
    seen = np.flatnonzero(projection.is_visible)
    if not seen.size:
        return seen
    side = max(1.0, (camera.width * camera.height * _POINTS_PER_CELL / seen.size) ** 0.5)
    across = int(camera.width // side) + 1
    cells = (projection.rows[seen] // side).astype(np.int64) * across
    cells += (projection.columns[seen] // side).astype(np.int64)
    nearest = np.full(int(cells.max()) + 1, np.inf)
    np.minimum.at(nearest, cells, projection.depths[seen])
    shown: NDArray[np.intp] = seen[projection.depths[seen] <= _SAME_SURFACE * nearest[cells]]
    return shown
