"""Which projected points are visible."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.format.cameras import Camera

_POINTS_PER_CELL = 2
_SAME_SURFACE = 1.05  # depths whose ratio is smaller belong to one surface


def drop_hidden(camera: Camera, projection: PointProjection) -> NDArray[np.intp]:
    """Indices of the points that no other point occludes.

    Of the points in a cell of the picture, only the nearest are kept. Cells are small, so that
    a stray point in front of the camera hides few others.
    """
    seen = np.flatnonzero(projection.within)
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
