"""Calls the numba kernels in order: project, bin, composite.

The functions take and return float32 arrays, without torch. `raster_numba` adds gradients
to these steps, and `pictures` uses them directly. Only one call may run at a time,
because numba's fallback threading layer does not support concurrent calls of kernels.
"""

import threading
from functools import lru_cache

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import NEAR_FRACTION
from quarc_ref.rendering import binning_kernels, projection_kernels, raster_kernels
from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.pipeline_data import (
    Band,
    Float32,
    Int32,
    Picture,
    Projection,
    SplatRows,
    Tiles,
)

KERNEL_LOCK = threading.Lock()


@lru_cache(maxsize=256)
def flatten_camera(camera: Camera) -> Float32:
    """Return the `[22]` numbers of a camera for `projection_kernels`."""
    center = camera_center(camera)
    near = NEAR_FRACTION * camera.near
    lens = (camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, near)
    with np.errstate(over="ignore"):  # non-finite Gaussians are not rendered
        return np.array([*camera.rotation, *camera.translation, *lens, *center], dtype=np.float32)


def project(camera: Camera, drawn: SplatRows) -> Projection:
    """Project Gaussians to a camera's picture plane."""
    count = drawn.means.shape[0]
    outputs = Projection(
        np.zeros((count, 2), dtype=np.float32),
        np.zeros((count, 3), dtype=np.float32),
        np.zeros((count, 3), dtype=np.float32),
        drawn.opacities,
        np.zeros(count, dtype=np.float32),
        np.zeros(count, dtype=np.float32),
        np.zeros(count, dtype=np.float32),
    )
    with KERNEL_LOCK:
        projection_kernels.project_forward(
            flatten_camera(camera),
            drawn.means, drawn.quaternions, drawn.scales, drawn.opacities, drawn.sh,
            outputs.means2d, outputs.conics, outputs.colors,
            outputs.depths, outputs.reaches, outputs.radii,
        )  # fmt: skip
    return outputs


def whole_band(camera: Camera) -> Band:
    """Return the band with all rows of tiles of a camera's picture."""
    return Band(0, -(-camera.height // TILE), -(-camera.width // TILE))


def count_pairs(projection: Projection, band: Band) -> Int32:
    """Return the `[N]` numbers of tiles of a band that Gaussians intersect."""
    with KERNEL_LOCK:
        counts: Int32 = binning_kernels.count_tiles(
            projection.means2d, projection.conics, projection.reaches, tuple(band)
        )
    return counts


def sort_nearest(projection: Projection) -> Int32:
    """Return the visible Gaussians by depth; those with equal depths keep their order."""
    with KERNEL_LOCK:
        order: Int32 = binning_kernels.sort_by_depth(projection.depths, projection.reaches)
    return order


def bin_tiles(camera: Camera, projection: Projection) -> Tiles:
    """List the Gaussians of every tile of a picture."""
    band = whole_band(camera)
    return list_pairs(projection, sort_nearest(projection), band, count_pairs(projection, band))


def list_pairs(projection: Projection, order: Int32, band: Band, counts: Int32) -> Tiles:
    """List the Gaussians of every tile of a band.

    Args:
        projection: Projected Gaussians.
        order: Visible Gaussians, nearest first.
        band: Rows of tiles.
        counts: `[N]` from `count_pairs`.
    """
    means2d, conics, reaches = projection.means2d, projection.conics, projection.reaches
    starts = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts, dtype=np.int64)])
    first, last = band.top * band.columns, band.bottom * band.columns
    with KERNEL_LOCK:
        tiles, rows = binning_kernels.list_tiles(means2d, conics, reaches, starts, tuple(band))
        borders, lists, rows, places = binning_kernels.fill_tiles(
            order, starts, tiles, rows, last - first
        )
    return Tiles(np.arange(first, last, dtype=np.int32), borders, lists, rows, starts, places)


def blank_picture(camera: Camera) -> Picture:
    """Return an empty picture of a camera's size."""
    return blank_rows(camera, 0, camera.height)


def blank_rows(camera: Camera, top: int, bottom: int) -> Picture:
    """Return empty rows of a camera's picture, from `top` to `bottom` - 1."""
    size = (bottom - top, camera.width)
    return Picture(np.zeros((*size, 3), dtype=np.float32), np.ones(size, dtype=np.float32), top)


def composite(
    projection: Projection,
    tiles: Tiles,
    background: Float32,
    picture: Picture,
    *,
    continues: bool = False,
) -> None:
    """Composite tiles into the rows of a picture.

    Args:
        projection: Projected Gaussians.
        tiles: Lists of Gaussians of the tiles.
        background: `[3]` background color.
        picture: Picture to modify.
        continues: Whether to continue behind existing content, on a black background.
    """
    with KERNEL_LOCK:
        raster_kernels.raster_forward(
            projection.means2d, projection.conics, projection.colors, projection.opacities,
            tiles.which, tiles.borders, tiles.lists, tiles.rows,
            background, continues, picture.top, picture.image, picture.transmittance,
        )  # fmt: skip
