"""Which Gaussians touch which tile of the picture, in the order of their depth.

Visible Gaussians are sorted once by depth; going through them in that order
and adding each to the lists of its tiles leaves every list sorted. A Gaussian
is listed where its ellipse, not only its box, meets a tile: a tile or row left
out holds no pixel at which its alpha reaches 1/255, so that the tiling does not
change the picture.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import entrance, parallel_entrance, plain

TILE = 16
_RADIX_BITS = 11
_RADIX = 1 << _RADIX_BITS
_0 = np.float32(0)
_2 = np.float32(2)
_HALF = np.float32(0.5)


@entrance
def sort_by_depth(depths, reaches):
    """Return the visible Gaussians, nearest first; equal depths in their own order."""
    order = np.flatnonzero(reaches > _0).astype(np.int32)
    keys = depths[order].view(np.uint32)
    spare_order, spare_keys = np.empty_like(order), np.empty_like(keys)
    for shift in (0, _RADIX_BITS, 2 * _RADIX_BITS):
        starts = np.zeros(_RADIX + 1, dtype=np.int64)
        for key in keys:
            starts[((key >> np.uint32(shift)) & np.uint32(_RADIX - 1)) + 1] += 1
        starts = np.cumsum(starts)
        for i in range(keys.size):
            digit = (keys[i] >> np.uint32(shift)) & np.uint32(_RADIX - 1)
            place = starts[digit]
            starts[digit] += 1
            spare_order[place], spare_keys[place] = order[i], keys[i]
        order, spare_order = spare_order, order
        keys, spare_keys = spare_keys, keys
    return order


@plain
def interval(a, b, c, reach, low, high):
    """Return how far the ellipse goes in x where y is from low to high, relative to its center.

    The ellipse is (a x^2 + 2 b x y + c y^2) / 2 <= reach. The first number is
    larger than the second where it does not go at all.
    """
    det = a * c - b * b
    top = math.sqrt(_2 * reach * a / det)
    if low > top or high < -top:
        return np.float32(1), np.float32(-1)
    most = math.sqrt(_2 * reach * c / det)
    turn = -b / c * most
    right = (
        most if low <= turn <= high else _edge(a, b, det, reach, _clamp(turn, low, high, top), 1)
    )
    left = -most if low <= -turn <= high else _edge(
        a, b, det, reach, _clamp(-turn, low, high, top), -1
    )  # fmt: skip
    return left, right


@plain
def _clamp(y, low, high, top):
    y = low if y < low else high
    return min(max(y, -top), top)


@plain
def _edge(a, b, det, reach, y, side):
    return (-b * y + side * math.sqrt(max(_0, _2 * reach * a - det * y * y))) / a


@plain
def _tiles_of_row(row, i, means2d, conics, reaches, tiles_x):
    """Return the first tile of a row that a Gaussian meets, and the one after its last."""
    low = np.float32(row * TILE) + _HALF - means2d[i, 1]
    high = low + np.float32(TILE - 1)
    left, right = interval(conics[i, 0], conics[i, 1], conics[i, 2], reaches[i], low, high)
    if left > right:
        return 0, 0
    first = int(math.floor((means2d[i, 0] + left - _HALF) / TILE))
    last = int(math.floor((means2d[i, 0] + right - _HALF) / TILE))
    return max(first, 0), min(last + 1, tiles_x)


@plain
def _rows_of(i, means2d, conics, reaches, tiles_y):
    a, b, c = conics[i, 0], conics[i, 1], conics[i, 2]
    extent = math.sqrt(_2 * reaches[i] * a / (a * c - b * b))
    first = int(math.floor((means2d[i, 1] - extent - _HALF) / TILE))
    last = int(math.floor((means2d[i, 1] + extent - _HALF) / TILE))
    return max(first, 0), min(last + 1, tiles_y)


@parallel_entrance
def count_tiles(means2d, conics, reaches, tiles_x, tiles_y):
    """Return `[N]` the number of tiles that each Gaussian meets."""
    counts = np.zeros(reaches.size, dtype=np.int32)
    for i in numba.prange(reaches.size):
        if reaches[i] <= _0:
            continue
        first_row, last_row = _rows_of(i, means2d, conics, reaches, tiles_y)
        for row in range(first_row, last_row):
            first, last = _tiles_of_row(row, i, means2d, conics, reaches, tiles_x)
            counts[i] += max(last - first, 0)
    return counts


@parallel_entrance
def list_tiles(means2d, conics, reaches, starts, tiles_x, tiles_y):
    """Return the tiles of each Gaussian, one Gaussian after the other.

    Args:
        starts: `[N + 1]` where each Gaussian's tiles begin: the sums of `count_tiles`.
    """
    tiles = np.empty(starts[-1], dtype=np.int32)
    for i in numba.prange(reaches.size):
        if reaches[i] <= _0:
            continue
        place = starts[i]
        first_row, last_row = _rows_of(i, means2d, conics, reaches, tiles_y)
        for row in range(first_row, last_row):
            first, last = _tiles_of_row(row, i, means2d, conics, reaches, tiles_x)
            for column in range(first, last):
                tiles[place] = row * tiles_x + column
                place += 1
    return tiles


@entrance
def fill_tiles(order, starts, tiles, tile_count):
    """Return the tiles' lists of Gaussians, and where in them each pair stands.

    Returns:
        `[T + 1]` where each tile's list begins, `[P]` the lists, and `[P]` the
        place in the lists of each pair of `tiles`.
    """
    borders = np.zeros(tile_count + 1, dtype=np.int64)
    for tile in tiles:
        borders[tile + 1] += 1
    borders = np.cumsum(borders)
    ends = borders[:-1].copy()
    lists = np.empty(tiles.size, dtype=np.int32)
    places = np.empty(tiles.size, dtype=np.int32)
    for i in order:
        for pair in range(starts[i], starts[i + 1]):
            place = ends[tiles[pair]]
            ends[tiles[pair]] = place + 1
            lists[place] = i
            places[pair] = place
    return borders, lists, places
