"""Kernels that merge the tile lists of added Gaussians with those of fixed ones."""

import numpy as np

from quarc_ref.rendering.compiled import entrance


@entrance
def merge_tiles(fixed_borders, fixed_lists, fixed_rows, fixed_depths, borders, lists, rows, depths):
    """Merge added Gaussians into the lists of tiles, after fixed ones of equal depth.

    Args:
        fixed_borders: `[T + 1]` borders of the fixed Gaussians, as in `Tiles`.
        fixed_lists: Lists of the fixed Gaussians, as in `Tiles`.
        fixed_rows: Rows of the fixed Gaussians, as in `Tiles`.
        fixed_depths: `[N]` depths of the fixed Gaussians.
        borders: `[T + 1]` borders of the added Gaussians, as in `Tiles`.
        lists: Lists of the added Gaussians, as in `Tiles`.
        rows: Rows of the added Gaussians, as in `Tiles`.
        depths: `[n]` depths of the added Gaussians.

    Returns:
        `[K]` changed tiles, `[K + 1]` starts of their lists, the lists (added Gaussians
        are numbered from N), their rows, and the position in them of each entry of
        `lists`.
    """
    which = np.flatnonzero(borders[1:] > borders[:-1]).astype(np.int32)
    merged_borders = np.zeros(which.size + 1, dtype=np.int64)
    for k, tile in enumerate(which):
        fixed_size = fixed_borders[tile + 1] - fixed_borders[tile]
        merged_borders[k + 1] = merged_borders[k] + fixed_size + borders[tile + 1] - borders[tile]
    merged = np.empty(merged_borders[-1], dtype=np.int32)
    merged_rows = np.empty((merged.size, 2), dtype=np.uint8)
    places = np.empty(lists.size, dtype=np.int32)
    for k, tile in enumerate(which):
        place, fixed, end = merged_borders[k], fixed_borders[tile], fixed_borders[tile + 1]
        for pair in range(borders[tile], borders[tile + 1]):
            depth = depths[lists[pair]]
            while fixed < end and fixed_depths[fixed_lists[fixed]] <= depth:
                merged[place], merged_rows[place] = fixed_lists[fixed], fixed_rows[fixed]
                place, fixed = place + 1, fixed + 1
            merged[place], merged_rows[place] = fixed_depths.size + lists[pair], rows[pair]
            places[pair] = place
            place += 1
        merged[place : merged_borders[k + 1]] = fixed_lists[fixed:end]
        merged_rows[place : merged_borders[k + 1]] = fixed_rows[fixed:end]
    return which, merged_borders, merged, merged_rows, places
