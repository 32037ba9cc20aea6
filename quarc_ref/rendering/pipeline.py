"""The numba kernels in their order: project, bin, composite.

Arrays in and arrays out, float32, no torch: `raster_numba` puts gradients
around these steps, `pictures` draws with them alone. One call at a time: numba's
fallback threading layer does not bear two threads in its kernels.
"""

import threading
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.constants import NEAR_FRACTION
from quarc_ref.format.records import Camera
from quarc_ref.rendering import binning_kernels, projection_kernels, raster_kernels
from quarc_ref.rendering.binning_kernels import TILE

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

KERNEL_LOCK = threading.Lock()


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Gaussians as they are drawn, a row to each; float32 and contiguous.

    Attributes:
        means: `[N, 3]` world units.
        quaternions: `[N, 4]` wxyz; the kernels normalize them.
        scales: `[N, 3]` standard deviations, world units.
        opacities: `[N]` 0 to 0.99.
        sh: `[N, 4, 3]` coefficient, then red, green, blue.
    """

    means: Float32
    quaternions: Float32
    scales: Float32
    opacities: Float32
    sh: Float32


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """Gaussians on the picture plane, a row to each; rows of those not drawn mean nothing.

    Attributes:
        means2d: `[N, 2]` pixels.
        conics: `[N, 3]` inverse covariance, a b c of a x^2 + 2 b x y + c y^2.
        colors: `[N, 3]` as seen from the camera, 0 and up.
        depths: `[N]` world units.
        reaches: `[N]` exponent at which alpha falls to 1/255; 0 where not drawn.
        radii: `[N]` three standard deviations, pixels; 0 where not drawn.
    """

    means2d: Float32
    conics: Float32
    colors: Float32
    depths: Float32
    reaches: Float32
    radii: Float32


@dataclass(frozen=True, slots=True, eq=False)
class Tiles:
    """Which Gaussians each tile composites.

    Attributes:
        which: `[T]` the tiles, counted along the rows of the picture.
        borders: `[T + 1]` where each tile's list begins in `lists`.
        lists: `[P]` Gaussians, nearest first within a tile.
        rows: `[P, 2]` the first row of its tile that each of them meets, and the
            one after its last.
        starts: `[N + 1]` where each Gaussian's pairs begin in `places`.
        places: `[P]` where each pair stands in `lists`.
    """

    which: Int32
    borders: Int64
    lists: Int32
    rows: NDArray[np.uint8]
    starts: Int64
    places: Int32


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """What has been drawn.

    Attributes:
        image: `[H, W, 3]`.
        transmittance: `[H, W]` negative where a pixel stopped early.
    """

    image: Float32
    transmittance: Float32


@lru_cache(maxsize=256)
def flatten_camera(camera: Camera) -> Float32:
    """Return `[22]` what `projection_kernels` needs of a camera."""
    rotation = np.array(camera.rotation).reshape(3, 3)
    center = -rotation.T @ np.array(camera.translation)
    near = NEAR_FRACTION * camera.near
    lens = (camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, near)
    return np.array([*camera.rotation, *camera.translation, *lens, *center], dtype=np.float32)


def project(camera: Camera, drawn: Drawn) -> Projection:
    """Project Gaussians onto a camera's picture plane."""
    count = drawn.means.shape[0]
    outputs = Projection(
        np.zeros((count, 2), dtype=np.float32),
        np.zeros((count, 3), dtype=np.float32),
        np.zeros((count, 3), dtype=np.float32),
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


def bin_tiles(camera: Camera, projection: Projection) -> Tiles:
    """List the Gaussians of every tile."""
    tiles_x, tiles_y = -(-camera.width // TILE), -(-camera.height // TILE)
    means2d, conics, reaches = projection.means2d, projection.conics, projection.reaches
    with KERNEL_LOCK:
        counts = binning_kernels.count_tiles(means2d, conics, reaches, tiles_x, tiles_y)
        starts = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
        tiles, rows = binning_kernels.list_tiles(means2d, conics, reaches, starts, tiles_x, tiles_y)
        order = binning_kernels.sort_by_depth(projection.depths, reaches)
        borders, lists, rows, places = binning_kernels.fill_tiles(
            order, starts, tiles, rows, tiles_x * tiles_y
        )
    which = np.arange(tiles_x * tiles_y, dtype=np.int32)
    return Tiles(which, borders, lists, rows, starts, places)


def blank_picture(camera: Camera) -> Picture:
    """Return a picture of a camera's size on which nothing is drawn yet."""
    size = (camera.height, camera.width)
    return Picture(np.empty((*size, 3), dtype=np.float32), np.empty(size, dtype=np.float32))


def composite(
    projection: Projection, opacities: Float32, tiles: Tiles, background: Float32, picture: Picture
) -> None:
    """Draw tiles of a picture."""
    with KERNEL_LOCK:
        raster_kernels.raster_forward(
            projection.means2d, projection.conics, projection.colors, opacities,
            tiles.which, tiles.borders, tiles.lists, tiles.rows,
            background, picture.image, picture.transmittance,
        )  # fmt: skip
