"""Adds Gaussians to a picture by rendering only the tiles that they intersect.

The result is bit-identical to rendering all Gaussians together, because the
rendered tiles have the same lists, and tiles without added Gaussians do not change.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering import merging_kernels
from quarc_ref.rendering.pipeline import (
    KERNEL_LOCK,
    bin_tiles,
    composite,
    make_blank_picture,
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
    """Fixed Gaussians, to which others can be added, and their picture.

    Attributes:
        projection: Projection of the fixed Gaussians.
        tiles: Tiles of the whole picture with the lists of the fixed Gaussians.
        picture: Picture of only the fixed Gaussians.
    """

    projection: Projection
    tiles: Tiles
    picture: Picture


def render_layer(camera: Camera, gaussians: SplatRows, background: Float32) -> Layer:
    """Render fixed Gaussians, to which other Gaussians can be added later."""
    projection = project(camera, gaussians)
    tiles = bin_tiles(camera, projection)
    picture = make_blank_picture(camera)
    composite(projection, tiles, background, picture)
    return Layer(projection, tiles, picture)


def join_layer(
    layer: Layer, added_projection: Projection, added_tiles: Tiles
) -> tuple[Projection, Tiles]:
    """Join the Gaussians of a layer with added Gaussians.

    Args:
        layer: Layer of fixed Gaussians, which come first in the result.
        added_projection: Projection of the added Gaussians.
        added_tiles: Tiles of the added Gaussians.

    Returns:
        The projection of all Gaussians, and the tiles that added Gaussians intersect. Depths,
        maximum exponents and radii of the projection, and `pair_starts` and `pair_positions` of the
        tiles, contain only added Gaussians.
    """
    fixed_projection = layer.projection
    projection = Projection(
        np.concatenate([fixed_projection.means2d, added_projection.means2d]),
        np.concatenate([fixed_projection.conics, added_projection.conics]),
        np.concatenate([fixed_projection.colors, added_projection.colors]),
        np.concatenate([fixed_projection.opacities, added_projection.opacities]),
        added_projection.depths,
        added_projection.max_exponents,
        added_projection.radii,
    )
    with KERNEL_LOCK:
        tile_ids, list_starts, lists, pixel_rows, merged_positions = merging_kernels.merge_tiles(
            layer.tiles.list_starts, layer.tiles.lists, layer.tiles.pixel_rows,
            fixed_projection.depths,
            added_tiles.list_starts, added_tiles.lists, added_tiles.pixel_rows,
            added_projection.depths,
        )  # fmt: skip
    merged_tiles = Tiles(
        tile_ids,
        list_starts,
        lists,
        pixel_rows,
        added_tiles.pair_starts,
        merged_positions[added_tiles.pair_positions],
    )
    return projection, merged_tiles
