"""A picture to which Gaussians are added: only the tiles that they meet are redrawn.

The pictures are those of all Gaussians drawn together, bit for bit: the lists of the tiles are the
same, and tiles without added Gaussians are unchanged.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering import merging_kernels
from quarc_ref.rendering.pipeline import (
    KERNEL_LOCK,
    bin_tiles,
    blank_picture,
    composite,
    project,
)
from quarc_ref.rendering.pipeline_data import (
    Drawn,
    Float32,
    Picture,
    Projection,
    Tiles,
)


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Fixed Gaussians and the picture of them alone.

    Attributes:
        projection: Projection of the Gaussians.
        tiles: Tiles of the whole picture.
        picture: Picture of these Gaussians alone.
    """

    projection: Projection
    tiles: Tiles
    picture: Picture


def draw_layer(camera: Camera, drawn: Drawn, background: Float32) -> Layer:
    """Draw Gaussians that do not change."""
    projection = project(camera, drawn)
    tiles = bin_tiles(camera, projection)
    picture = blank_picture(camera)
    composite(projection, tiles, background, picture)
    return Layer(projection, tiles, picture)


def join_layer(layer: Layer, added: Projection, tiles: Tiles) -> tuple[Projection, Tiles]:
    """Return a layer's Gaussians and the added, and the tiles that these meet.

    Args:
        layer: Its Gaussians come first.
        added: `[n]` Gaussians.
        tiles: Tiles of the added Gaussians only, as are `starts` and `places` of the result.
    """
    under = layer.projection
    projection = Projection(
        np.concatenate([under.means2d, added.means2d]),
        np.concatenate([under.conics, added.conics]),
        np.concatenate([under.colors, added.colors]),
        np.concatenate([under.opacities, added.opacities]),
        added.depths,
        added.reaches,
        added.radii,
    )
    with KERNEL_LOCK:
        which, borders, lists, rows, shifted = merging_kernels.merge_tiles(
            layer.tiles.borders, layer.tiles.lists, layer.tiles.rows, under.depths,
            tiles.borders, tiles.lists, tiles.rows, added.depths,
        )  # fmt: skip
    merged = Tiles(which, borders, lists, rows, tiles.starts, shifted[tiles.places])
    return projection, merged
