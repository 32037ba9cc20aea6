"""Data types that the rendering steps exchange; they consist of contiguous arrays."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class SplatRows:
    """Gaussians to render, one row per Gaussian.

    Attributes:
        means: `[N, 3]` centers, world units.
        quaternions: `[N, 4]` quaternions wxyz, which the kernels normalize.
        scales: `[N, 3]` standard deviations, world units.
        opacities: `[N]` opacities from 0 to 0.99.
        sh: `[N, 1, 3]` or `[N, 4, 3]` SH coefficients of red, green and blue.
    """

    means: Float32
    quaternions: Float32
    scales: Float32
    opacities: Float32
    sh: Float32


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """Projected Gaussians, one row per Gaussian; rows of invisible Gaussians are undefined.

    Attributes:
        means2d: `[N, 2]` centers, pixels.
        conics: `[N, 3]` inverse covariances, as a, b and c of a x^2 + 2 b x y + c y^2.
        colors: `[N, 3]` colors as seen by the camera, at least 0.
        opacities: `[N]` opacities from 0 to 0.99.
        depths: `[N]` depths, world units.
        max_exponents: `[N]` exponents at which alpha is 1/255; 0 for invisible Gaussians.
        radii: `[N]` three standard deviations, pixels; 0 for invisible Gaussians.
    """

    means2d: Float32
    conics: Float32
    colors: Float32
    opacities: Float32
    depths: Float32
    max_exponents: Float32
    radii: Float32

    def take(self, rows: Int32 | slice) -> "Projection":
        """Return the selected rows of all arrays."""
        return Projection(
            self.means2d[rows],
            self.conics[rows],
            self.colors[rows],
            self.opacities[rows],
            self.depths[rows],
            self.max_exponents[rows],
            self.radii[rows],
        )


class Band(NamedTuple):
    """A range of rows of tiles in a picture.

    Attributes:
        top: First row of tiles.
        bottom: End row (exclusive).
        column_count: Number of tiles per row.
    """

    top: int
    bottom: int
    column_count: int


@dataclass(frozen=True, slots=True, eq=False)
class Tiles:
    """Lists of the Gaussians in each tile of a band.

    Attributes:
        tile_ids: `[T]` indices of the tiles, counted row by row in the whole picture.
        list_starts: `[T + 1]` start of each tile's list in `lists`.
        lists: `[P]` indices of Gaussians, nearest first within a tile.
        pixel_rows: `[P, 2]` first and end pixel row (exclusive) that the Gaussian of each entry of
            `lists` intersects in its tile.
        pair_starts: `[N + 1]` start of each Gaussian's pairs in `pair_positions`.
        pair_positions: `[P]` position in `lists` of each pair of a Gaussian and a tile.
    """

    tile_ids: Int32
    list_starts: Int64
    lists: Int32
    pixel_rows: NDArray[np.uint8]
    pair_starts: Int64
    pair_positions: Int32


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Consecutive pixel rows of a camera's picture.

    Attributes:
        image: `[H, W, 3]` colors.
        transmittance: `[H, W]` transmittances; the sign is negative for opaque pixels.
        top: Index of the first row in the whole picture.
    """

    image: Float32
    transmittance: Float32
    top: int = 0
