"""Kernels that assign Gaussians to the tiles of a picture in the order of depth.

Visible Gaussians are sorted once by depth and then added to the lists of their tiles, so
every list is sorted. A Gaussian is listed in the tiles and rows that its ellipse, and not
only its bounding box, intersects. Its alpha is below 1/255 at all other pixels, so tiling
does not change the picture.

A band is given by its first row of tiles, the row after its last one, and the number of
tiles per row. Floats are clamped before they are converted to integers, and Gaussians
with non-finite numbers are assigned to no tile, because other conversions depend on the
machine.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import entrance, parallel_entrance, plain

TILE = 16
_RADIX_BITS = 11
_RADIX = 1 << _RADIX_BITS
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_HALF = np.float32(0.5)
_LAST = np.float32(TILE - 1)


@entrance
def sort_by_depth(depths, reaches):
    """Return the visible Gaussians by depth; those with equal depths keep their order."""
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
def _outline(i, means2d, conics, reaches):
    """Return center x, y; b; 1/a, 1/c; 2 reach a, 2 reach c; det; half width and half height.

    The ellipse is (a x^2 + 2 b x y + c y^2) / 2 <= reach, where det is a c - b^2.
    """
    a, b, c = conics[i, 0], conics[i, 1], conics[i, 2]
    det = a * c - b * b
    most_a, most_c = _2 * reaches[i] * a, _2 * reaches[i] * c
    inverse = _1 / det
    width, height = math.sqrt(most_c * inverse), math.sqrt(most_a * inverse)
    return (means2d[i, 0], means2d[i, 1], b, _1 / a, _1 / c, most_a, most_c, det, width, height)


@plain
def _interval(b, inverse, most, det, half, other, turn, low, high):
    """Return the extent of an ellipse along one axis within a range of the other axis.

    The first number exceeds the second if the ellipse is outside the range.

    Args:
        b: Coefficient b of the conic.
        inverse: Inverse of the conic's coefficient for the axis.
        most: Twice the reach multiplied by this coefficient.
        det: Determinant of the conic.
        half: Half of the ellipse's extent along the axis.
        other: Half of its extent along the other axis.
        turn: Position on the other axis where the extent is largest.
        low: Start of the range, relative to the center.
        high: End of the range, relative to the center.
    """
    if low > other or high < -other:
        return _1, -_1
    end, begin = half, -half
    if not low <= turn <= high:
        at = min(max(low if turn < low else high, -other), other)
        end = (math.sqrt(max(_0, most - det * at * at)) - b * at) * inverse
    if not low <= -turn <= high:
        at = min(max(low if -turn < low else high, -other), other)
        begin = (-math.sqrt(max(_0, most - det * at * at)) - b * at) * inverse
    return begin, end


@plain
def _clamp(value, least, most):
    return min(max(value, least), most)


@plain
def _columns_of(row, outline, columns):
    """Return the first tile of a row that an ellipse intersects, and the one after the last."""
    x, y, b, inverse_a, inverse_c, most_a, _, det, width, height = outline
    low = np.float32(row * TILE) + _HALF - y
    begin, end = _interval(
        b, inverse_a, most_a, det, width, height, -b * inverse_c * width, low, low + _LAST
    )
    if not begin <= end:
        return 0, 0
    first = int(math.floor(_clamp((x + begin - _HALF) / TILE, 0, columns)))
    last = int(math.floor(_clamp((x + end - _HALF) / TILE, -1, columns)))
    return first, min(last + 1, columns)


@plain
def _rows_in(row, column, outline):
    """Return the first pixel row of a tile that an ellipse meets, and the one after the last."""
    x, y, b, inverse_a, inverse_c, _, most_c, det, width, height = outline
    low = np.float32(column * TILE) + _HALF - x
    begin, end = _interval(
        b, inverse_c, most_c, det, height, width, -b * inverse_a * height, low, low + _LAST
    )
    if not begin <= end:
        return 0, 0
    top = y - _HALF - np.float32(row * TILE)
    first = int(math.ceil(_clamp(top + begin, 0, TILE)))
    last = int(math.floor(_clamp(top + end, -1, TILE)))
    return first, min(last + 1, TILE)


@plain
def _tile_rows_of(outline, top, bottom):
    """Return the first row of tiles that an ellipse intersects, and the one after the last."""
    x, y, width, height = outline[0], outline[1], outline[8], outline[9]
    if not (math.isfinite(x + width) and math.isfinite(y + height)):
        return top, top
    first = int(math.floor(_clamp((y - height - _HALF) / TILE, top, bottom)))
    last = int(math.floor(_clamp((y + height - _HALF) / TILE, top - 1, bottom)))
    return first, min(last + 1, bottom)


@parallel_entrance
def count_tiles(means2d, conics, reaches, band):
    """Return the `[N]` numbers of tiles of a band that Gaussians intersect."""
    top, bottom, columns = band
    counts = np.zeros(reaches.size, dtype=np.int32)
    for i in numba.prange(reaches.size):
        if not reaches[i] > _0:
            continue
        outline = _outline(i, means2d, conics, reaches)
        first_row, last_row = _tile_rows_of(outline, top, bottom)
        for row in range(first_row, last_row):
            first, last = _columns_of(row, outline, columns)
            counts[i] += max(last - first, 0)
    return counts


@parallel_entrance
def list_tiles(means2d, conics, reaches, starts, band):
    """Return the tiles of each Gaussian, concatenated.

    Args:
        starts: `[N + 1]` start of each Gaussian's tiles: cumulative sums of `count_tiles`.
        band: Band, as for `count_tiles`.

    Returns:
        `[P]` tiles, counted along the rows of the band, and `[P, 2]` first pixel row of
        each tile that the Gaussian intersects, and the row after the last.
    """
    top, bottom, columns = band
    tiles = np.empty(starts[-1], dtype=np.int32)
    rows = np.empty((starts[-1], 2), dtype=np.uint8)
    for i in numba.prange(reaches.size):
        if not reaches[i] > _0:
            continue
        place = starts[i]
        outline = _outline(i, means2d, conics, reaches)
        first_row, last_row = _tile_rows_of(outline, top, bottom)
        for row in range(first_row, last_row):
            first, last = _columns_of(row, outline, columns)
            for column in range(first, last):
                tiles[place] = (row - top) * columns + column
                rows[place, 0], rows[place, 1] = _rows_in(row, column, outline)
                place += 1
    return tiles, rows


@entrance
def fill_tiles(order, starts, tiles, rows, tile_count):
    """Return the tiles' lists of Gaussians, and the position of each pair in them.

    Returns:
        `[T + 1]` start of each tile's list, `[P]` lists, `[P, 2]` their rows, and `[P]`
        position in the lists of each pair of `tiles`.
    """
    borders = np.zeros(tile_count + 1, dtype=np.int64)
    for tile in tiles:
        borders[tile + 1] += 1
    borders = np.cumsum(borders)
    ends = borders[:-1].copy()
    lists = np.empty(tiles.size, dtype=np.int32)
    listed_rows = np.empty_like(rows)
    places = np.empty(tiles.size, dtype=np.int32)
    for i in order:
        for pair in range(starts[i], starts[i + 1]):
            place = ends[tiles[pair]]
            ends[tiles[pair]] = place + 1
            lists[place] = i
            listed_rows[place, 0], listed_rows[place, 1] = rows[pair, 0], rows[pair, 1]
            places[pair] = place
    return borders, lists, listed_rows, places
