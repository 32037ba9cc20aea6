"""Determines which projected points are not occluded by other points."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.format.cameras import Camera

_POINTS_PER_CELL = 2
_MAX_SURFACE_DEPTH_RATIO = 1.05  # depths with a smaller ratio belong to the same surface


def find_visible_points(camera: Camera, projection: PointProjection) -> NDArray[np.intp]:
    """Return the indices of the points in the picture that no other point occludes.

    The picture is divided into cells, and only the nearest points in each cell count as visible.
    The cells are small, so that a wrong point near the camera hides only a few points.
    """
    inside_indices = np.flatnonzero(projection.is_visible)
    if not inside_indices.size:
        return inside_indices
    cell_size = max(
        1.0, (camera.width * camera.height * _POINTS_PER_CELL / inside_indices.size) ** 0.5
    )
    cells_per_row = int(camera.width // cell_size) + 1
    cells = (projection.rows[inside_indices] // cell_size).astype(np.int64) * cells_per_row
    cells += (projection.columns[inside_indices] // cell_size).astype(np.int64)
    nearest_depths = np.full(int(cells.max()) + 1, np.inf)
    np.minimum.at(nearest_depths, cells, projection.depths[inside_indices])
    visible_indices: NDArray[np.intp] = inside_indices[
        projection.depths[inside_indices] <= _MAX_SURFACE_DEPTH_RATIO * nearest_depths[cells]
    ]
    return visible_indices
