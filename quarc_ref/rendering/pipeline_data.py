"""Data passed between the steps of rendering: contiguous float32 arrays."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Gaussians to render, one row per Gaussian.

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
    """Gaussians on the picture plane, a row to each; rows of those not drawn are undefined.

    Attributes:
        means2d: `[N, 2]` pixels.
        conics: `[N, 3]` inverse covariance, a b c of a x^2 + 2 b x y + c y^2.
        colors: `[N, 3]` as seen from the camera, 0 and up.
        opacities: `[N]` 0 to 0.99.
        depths: `[N]` world units.
        reaches: `[N]` exponent at which alpha falls to 1/255; 0 where not drawn.
        radii: `[N]` three standard deviations, pixels; 0 where not drawn.
    """

    means2d: Float32
    conics: Float32
    colors: Float32
    opacities: Float32
    depths: Float32
    reaches: Float32
    radii: Float32

    def take(self, rows: Int32 | slice) -> "Projection":
        """Return some of the Gaussians."""
        return Projection(
            self.means2d[rows],
            self.conics[rows],
            self.colors[rows],
            self.opacities[rows],
            self.depths[rows],
            self.reaches[rows],
            self.radii[rows],
        )


class Band(NamedTuple):
    """Rows of a picture's tiles.

    Attributes:
        top: The first.
        bottom: The one after the last.
        columns: Tiles of a row.
    """

    top: int
    bottom: int
    columns: int


@dataclass(frozen=True, slots=True, eq=False)
class Tiles:
    """Which Gaussians each tile of a band composites.

    Attributes:
        which: `[T]` the tiles, counted along the rows of the whole picture.
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
    """Rows of a camera's picture, as many as a whole number of tiles unless they are the last.

    Attributes:
        image: `[H, W, 3]`.
        transmittance: `[H, W]` negative where a pixel stopped early.
        top: The row of the whole picture that the first of them is.
    """

    image: Float32
    transmittance: Float32
    top: int = 0
