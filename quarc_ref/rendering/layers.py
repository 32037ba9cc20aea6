"""Adds Gaussians to a picture by rendering only the tiles that they intersect.

The result is bit-identical to rendering all Gaussians together, because the lists of
tiles are the same, and tiles without added Gaussians do not change.
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
    Float32,
    Picture,
    Projection,
    SplatRows,
    Tiles,
)


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Fixed Gaussians and their picture.

    Attributes:
        projection: Projection of the Gaussians.
        tiles: Tiles of the whole picture.
        picture: Picture of these Gaussians alone.
    """

    projection: Projection
    tiles: Tiles
    picture: Picture


def draw_layer(camera: Camera, drawn: SplatRows, background: Float32) -> Layer:
    """Render fixed Gaussians."""
    projection = project(camera, drawn)
    tiles = bin_tiles(camera, projection)
    picture = blank_picture(camera)
    composite(projection, tiles, background, picture)
    return Layer(projection, tiles, picture)


def join_layer(layer: Layer, added: Projection, tiles: Tiles) -> tuple[Projection, Tiles]:
    """Join a layer's Gaussians with added ones, and find the tiles that the added ones intersect.

    Args:
        layer: Layer, whose Gaussians come first.
        added: `[n]` added Gaussians.
        tiles: Tiles of the added Gaussians only, like `starts` and `places` of the result.
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
