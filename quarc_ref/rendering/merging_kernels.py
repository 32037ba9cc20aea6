"""Kernels that merge the tile lists of added and fixed Gaussians."""

import numpy as np

from quarc_ref.rendering.compiled import entry_kernel


@entry_kernel
def merge_tiles(
    fixed_list_starts,
    fixed_lists,
    fixed_pixel_rows,
    fixed_depths,
    list_starts,
    lists,
    pixel_rows,
    depths,
):
    """Merge added Gaussians into tile lists; at equal depths, fixed Gaussians come first.

    Args:
        fixed_list_starts: `Tiles.list_starts` of the fixed Gaussians, `[T + 1]`.
        fixed_lists: `Tiles.lists` of the fixed Gaussians.
        fixed_pixel_rows: `Tiles.pixel_rows` of the fixed Gaussians.
        fixed_depths: `[N]` depths of the fixed Gaussians.
        list_starts: `Tiles.list_starts` of the added Gaussians, `[T + 1]`.
        lists: `Tiles.lists` of the added Gaussians.
        pixel_rows: `Tiles.pixel_rows` of the added Gaussians.
        depths: `[n]` depths of the added Gaussians.

    Returns:
        `[K]` changed tiles; `[K + 1]` starts of the merged lists of these tiles; the merged lists,
        in which added Gaussian i has the index N + i; pixel rows of the merged list entries;
        position of each entry of `lists` in the merged lists.
    """
    tile_ids = np.flatnonzero(list_starts[1:] > list_starts[:-1]).astype(np.int32)
    merged_list_starts = np.zeros(tile_ids.size + 1, dtype=np.int64)
    for k, tile in enumerate(tile_ids):
        fixed_list_size = fixed_list_starts[tile + 1] - fixed_list_starts[tile]
        merged_list_starts[k + 1] = (
            merged_list_starts[k] + fixed_list_size + list_starts[tile + 1] - list_starts[tile]
        )
    merged_lists = np.empty(merged_list_starts[-1], dtype=np.int32)
    merged_pixel_rows = np.empty((merged_lists.size, 2), dtype=np.uint8)
    positions = np.empty(lists.size, dtype=np.int32)
    for k, tile in enumerate(tile_ids):
        position, fixed_position, end = (
            merged_list_starts[k],
            fixed_list_starts[tile],
            fixed_list_starts[tile + 1],
        )
        for pair in range(list_starts[tile], list_starts[tile + 1]):
            depth = depths[lists[pair]]
            while fixed_position < end and fixed_depths[fixed_lists[fixed_position]] <= depth:
                merged_lists[position], merged_pixel_rows[position] = (
                    fixed_lists[fixed_position],
                    fixed_pixel_rows[fixed_position],
                )
                position, fixed_position = position + 1, fixed_position + 1
            merged_lists[position], merged_pixel_rows[position] = (
                fixed_depths.size + lists[pair],
                pixel_rows[pair],
            )
            positions[pair] = position
            position += 1
        merged_lists[position : merged_list_starts[k + 1]] = fixed_lists[fixed_position:end]
        merged_pixel_rows[position : merged_list_starts[k + 1]] = fixed_pixel_rows[
            fixed_position:end
        ]
    return tile_ids, merged_list_starts, merged_lists, merged_pixel_rows, positions
