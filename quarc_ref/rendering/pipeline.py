"""Calls the numba kernels that project, bin and composite Gaussians.

The functions take and return float32 arrays and do not need torch. `pictures` calls these
functions directly, and `raster_numba` adds gradients. Only one kernel may run at a time,
because numba's fallback threading layer does not support concurrent kernels.
"""

import threading
from functools import lru_cache

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LOW_PASS, NEAR_FRACTION
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
_SLOPE_MARGIN_FRACTION = 0.15  # relative to the picture size


@lru_cache(maxsize=256)
def flatten_camera(camera: Camera, low_pass: tuple[float, float] = (LOW_PASS, LOW_PASS)) -> Float32:
    """Return a camera as the array `[28]` that `projection_kernels` takes."""
    center = camera_center(camera)
    nearest_depth = NEAR_FRACTION * camera.near
    intrinsics = (
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        camera.width,
        camera.height,
        nearest_depth,
    )
    slope_limits = (
        *_find_slope_limits(camera.cx, camera.fx, camera.width),
        *_find_slope_limits(camera.cy, camera.fy, camera.height),
    )
    with np.errstate(over="ignore"):  # non-finite Gaussians are not rendered
        return np.array(
            [*camera.rotation, *camera.translation, *intrinsics, *center, *low_pass, *slope_limits],
            dtype=np.float32,
        )


def _find_slope_limits(center: float, focal: float, size: int) -> tuple[float, float]:
    """Return the minimum and the maximum of x/z (or y/z) for the Jacobian."""
    margin = _SLOPE_MARGIN_FRACTION * size
    return -(center + margin) / focal, (size - center + margin) / focal


def project(
    camera: Camera,
    gaussians: SplatRows,
    low_pass: tuple[float, float] = (LOW_PASS, LOW_PASS),
) -> Projection:
    """Project Gaussians to the picture plane of a camera.

    Args:
        camera: The camera.
        gaussians: Gaussians to project.
        low_pass: Variances of the low-pass filter in x and y, in pixels.
    """
    gaussian_count = gaussians.means.shape[0]
    projection = Projection(
        np.zeros((gaussian_count, 2), dtype=np.float32),
        np.zeros((gaussian_count, 3), dtype=np.float32),
        np.zeros((gaussian_count, 3), dtype=np.float32),
        gaussians.opacities,
        np.zeros(gaussian_count, dtype=np.float32),
        np.zeros(gaussian_count, dtype=np.float32),
        np.zeros(gaussian_count, dtype=np.float32),
    )
    with KERNEL_LOCK:
        projection_kernels.project_forward(
            flatten_camera(camera, low_pass),
            gaussians.means, gaussians.quaternions, gaussians.scales,
            gaussians.opacities, gaussians.sh,
            projection.means2d, projection.conics, projection.colors,
            projection.depths, projection.max_exponents, projection.radii,
        )  # fmt: skip
    return projection


def make_full_band(camera: Camera) -> Band:
    """Return the band that contains all tiles of a camera's picture."""
    return Band(0, -(-camera.height // TILE), -(-camera.width // TILE))


def count_pairs(projection: Projection, band: Band) -> Int32:
    """Return the `[N]` number of tiles of a band that each Gaussian intersects."""
    with KERNEL_LOCK:
        pair_counts: Int32 = binning_kernels.count_tiles(
            projection.means2d, projection.conics, projection.max_exponents, tuple(band)
        )
    return pair_counts


def sort_by_depth(projection: Projection) -> Int32:
    """Return the indices of visible Gaussians, sorted by depth; the sort is stable."""
    with KERNEL_LOCK:
        order: Int32 = binning_kernels.sort_by_depth(projection.depths, projection.max_exponents)
    return order


def bin_tiles(camera: Camera, projection: Projection) -> Tiles:
    """List the Gaussians of every tile of a picture."""
    band = make_full_band(camera)
    return bin_band(projection, sort_by_depth(projection), band, count_pairs(projection, band))


def bin_band(projection: Projection, order: Int32, band: Band, pair_counts: Int32) -> Tiles:
    """List the Gaussians of every tile of a band.

    Args:
        projection: Projected Gaussians.
        order: Indices of visible Gaussians, nearest first.
        band: The band.
        pair_counts: `[N]` result of `count_pairs`.
    """
    means2d, conics, max_exponents = projection.means2d, projection.conics, projection.max_exponents
    pair_starts = np.concatenate(
        [np.zeros(1, dtype=np.int64), np.cumsum(pair_counts, dtype=np.int64)]
    )
    first_tile, end_tile = band.top * band.column_count, band.bottom * band.column_count
    with KERNEL_LOCK:
        tiles, pixel_rows = binning_kernels.list_tiles(
            means2d, conics, max_exponents, pair_starts, tuple(band)
        )
        list_starts, lists, pixel_rows, pair_positions = binning_kernels.fill_tiles(
            order, pair_starts, tiles, pixel_rows, end_tile - first_tile
        )
    return Tiles(
        np.arange(first_tile, end_tile, dtype=np.int32),
        list_starts,
        lists,
        pixel_rows,
        pair_starts,
        pair_positions,
    )


def make_blank_picture(camera: Camera) -> Picture:
    """Return a blank picture that has the size of the camera's pictures."""
    return make_blank_rows(camera, 0, camera.height)


def make_blank_rows(camera: Camera, top: int, bottom: int) -> Picture:
    """Return blank rows `top` to `bottom` - 1 of a camera's picture."""
    shape = (bottom - top, camera.width)
    return Picture(np.zeros((*shape, 3), dtype=np.float32), np.ones(shape, dtype=np.float32), top)


def composite(
    projection: Projection,
    tiles: Tiles,
    background: Float32,
    picture: Picture,
    *,
    is_continuation: bool = False,
) -> None:
    """Composite tiles into the rows of a picture.

    Args:
        projection: Projected Gaussians.
        tiles: Tiles with their lists of Gaussians.
        background: `[3]` background color.
        picture: Picture to modify.
        is_continuation: Whether to add Gaussians behind the existing content of the picture;
            requires a black background.
    """
    with KERNEL_LOCK:
        raster_kernels.raster_forward(
            projection.means2d, projection.conics, projection.colors, projection.opacities,
            tiles.tile_ids, tiles.list_starts, tiles.lists, tiles.pixel_rows,
            background, is_continuation, picture.top, picture.image, picture.transmittance,
        )  # fmt: skip
