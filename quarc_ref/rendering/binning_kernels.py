"""Kernels that assign Gaussians to the tiles of a picture in depth order.

Visible Gaussians are sorted once by depth and then added to the lists of their tiles, so every list
is sorted. A Gaussian is listed only in the tiles and rows that its ellipse intersects, not in all
that its bounding box intersects. The alpha of the Gaussian is below 1/255 at all other pixels, so
tiling does not change the picture.

A band is a tuple of its first row of tiles, its end row (exclusive), and the number of tiles per
row. Converting NaN or an out-of-range float to an integer gives different results on different
machines. Therefore, floats are clamped before the conversion, and Gaussians with non-finite values
are assigned to no tile.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import entry_kernel, kernel, parallel_kernel

TILE = 16
_DIGIT_BITS = 11
_BUCKET_COUNT = 1 << _DIGIT_BITS
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_HALF = np.float32(0.5)
_LAST_PIXEL = np.float32(TILE - 1)


@entry_kernel
def sort_by_depth(depths, max_exponents):
    """Return the indices of visible Gaussians, sorted by depth; the sort is stable."""
    order = np.flatnonzero(max_exponents > _0).astype(np.int32)
    keys = depths[order].view(np.uint32)
    spare_order, spare_keys = np.empty_like(order), np.empty_like(keys)
    for shift in (0, _DIGIT_BITS, 2 * _DIGIT_BITS):
        starts = np.zeros(_BUCKET_COUNT + 1, dtype=np.int64)
        for key in keys:
            starts[((key >> np.uint32(shift)) & np.uint32(_BUCKET_COUNT - 1)) + 1] += 1
        starts = np.cumsum(starts)
        for index in range(keys.size):
            digit = (keys[index] >> np.uint32(shift)) & np.uint32(_BUCKET_COUNT - 1)
            position = starts[digit]
            starts[digit] += 1
            spare_order[position], spare_keys[position] = order[index], keys[index]
        order, spare_order = spare_order, order
        keys, spare_keys = spare_keys, keys
    return order


@kernel
def _compute_ellipse(i, means2d, conics, max_exponents):
    """Return the ellipse at whose border the alpha of a Gaussian is 1/255.

    The ellipse is (a x^2 + 2 b x y + c y^2) / 2 <= e, where e is the maximum exponent.

    Returns:
        Center x, y; b; 1 / a; 1 / c; 2 e a; 2 e c; determinant a c - b^2; half of the width;
        half of the height.
    """
    a, b, c = conics[i, 0], conics[i, 1], conics[i, 2]
    det = a * c - b * b
    two_e_a, two_e_c = _2 * max_exponents[i] * a, _2 * max_exponents[i] * c
    inverse_det = _1 / det
    half_width, half_height = math.sqrt(two_e_c * inverse_det), math.sqrt(two_e_a * inverse_det)
    return (
        means2d[i, 0],
        means2d[i, 1],
        b,
        _1 / a,
        _1 / c,
        two_e_a,
        two_e_c,
        det,
        half_width,
        half_height,
    )


@kernel
def _compute_extent(
    b,
    inverse_coefficient,
    two_e_coefficient,
    det,
    half_extent,
    other_half_extent,
    turning_point,
    low,
    high,
):
    """Return the extent of an ellipse along one axis within a range of the other axis.

    The extent is returned as its start and its end, both relative to the center. The start exceeds
    the end if the ellipse is outside the range.

    Args:
        b: Coefficient b of the conic.
        inverse_coefficient: Reciprocal of the conic's coefficient for the axis.
        two_e_coefficient: Twice the maximum exponent e, multiplied by the conic's coefficient for
            the axis.
        det: Determinant of the conic.
        half_extent: Half of the ellipse's extent along the axis.
        other_half_extent: Half of the ellipse's extent along the other axis.
        turning_point: Position on the other axis where the extent is largest.
        low: Start of the range, relative to the center.
        high: End of the range, relative to the center.
    """
    if low > other_half_extent or high < -other_half_extent:
        return _1, -_1
    end, begin = half_extent, -half_extent
    if not low <= turning_point <= high:
        position = min(
            max(low if turning_point < low else high, -other_half_extent), other_half_extent
        )
        end = (
            math.sqrt(max(_0, two_e_coefficient - det * position * position)) - b * position
        ) * inverse_coefficient
    if not low <= -turning_point <= high:
        position = min(
            max(low if -turning_point < low else high, -other_half_extent), other_half_extent
        )
        begin = (
            -math.sqrt(max(_0, two_e_coefficient - det * position * position)) - b * position
        ) * inverse_coefficient
    return begin, end


@kernel
def _clamp(value, low, high):
    return min(max(value, low), high)


@kernel
def _find_tile_columns(row, ellipse, column_count):
    """Return the first and end tile column (exclusive) that an ellipse intersects in a tile row."""
    x, y, b, inverse_a, inverse_c, two_e_a, _, det, half_width, half_height = ellipse
    low = np.float32(row * TILE) + _HALF - y
    begin, end = _compute_extent(
        b,
        inverse_a,
        two_e_a,
        det,
        half_width,
        half_height,
        -b * inverse_c * half_width,
        low,
        low + _LAST_PIXEL,
    )
    if not begin <= end:
        return 0, 0
    first = int(math.floor(_clamp((x + begin - _HALF) / TILE, 0, column_count)))
    last = int(math.floor(_clamp((x + end - _HALF) / TILE, -1, column_count)))
    return first, min(last + 1, column_count)


@kernel
def _find_pixel_rows(row, column, ellipse):
    """Return the first and the end row (exclusive) of the part of a tile in an ellipse."""
    x, y, b, inverse_a, inverse_c, _, two_e_c, det, half_width, half_height = ellipse
    low = np.float32(column * TILE) + _HALF - x
    begin, end = _compute_extent(
        b,
        inverse_c,
        two_e_c,
        det,
        half_height,
        half_width,
        -b * inverse_a * half_height,
        low,
        low + _LAST_PIXEL,
    )
    if not begin <= end:
        return 0, 0
    center_row = y - _HALF - np.float32(row * TILE)
    first = int(math.ceil(_clamp(center_row + begin, 0, TILE)))
    last = int(math.floor(_clamp(center_row + end, -1, TILE)))
    return first, min(last + 1, TILE)


@kernel
def _find_tile_rows(ellipse, top, bottom):
    """Return the first and the end tile row (exclusive) that an ellipse intersects."""
    x, y, half_width, half_height = ellipse[0], ellipse[1], ellipse[8], ellipse[9]
    if not (math.isfinite(x + half_width) and math.isfinite(y + half_height)):
        return top, top
    first = int(math.floor(_clamp((y - half_height - _HALF) / TILE, top, bottom)))
    last = int(math.floor(_clamp((y + half_height - _HALF) / TILE, top - 1, bottom)))
    return first, min(last + 1, bottom)


@parallel_kernel
def count_tiles(means2d, conics, max_exponents, band):
    """Return the `[N]` number of tiles of a band that each Gaussian intersects."""
    top, bottom, column_count = band
    tile_counts = np.zeros(max_exponents.size, dtype=np.int32)
    for i in numba.prange(max_exponents.size):
        if not max_exponents[i] > _0:
            continue
        ellipse = _compute_ellipse(i, means2d, conics, max_exponents)
        first_row, end_row = _find_tile_rows(ellipse, top, bottom)
        for row in range(first_row, end_row):
            first, end = _find_tile_columns(row, ellipse, column_count)
            tile_counts[i] += max(end - first, 0)
    return tile_counts


@parallel_kernel
def list_tiles(means2d, conics, max_exponents, pair_starts, band):
    """Return the tiles that the Gaussians intersect, one Gaussian after the other.

    Args:
        pair_starts: `[N + 1]` start of each Gaussian's tiles in the result: the cumulative sums of
            `count_tiles`.
        band: First row of tiles, end row (exclusive), and number of tiles per row.

    Returns:
        `[P]` indices of tiles, counted row by row within the band; `[P, 2]` first and end pixel row
        (exclusive) that the Gaussian intersects in each of these tiles.
    """
    top, bottom, column_count = band
    tiles = np.empty(pair_starts[-1], dtype=np.int32)
    pixel_rows = np.empty((pair_starts[-1], 2), dtype=np.uint8)
    for i in numba.prange(max_exponents.size):
        if not max_exponents[i] > _0:
            continue
        position = pair_starts[i]
        ellipse = _compute_ellipse(i, means2d, conics, max_exponents)
        first_row, end_row = _find_tile_rows(ellipse, top, bottom)
        for row in range(first_row, end_row):
            first, end = _find_tile_columns(row, ellipse, column_count)
            for column in range(first, end):
                tiles[position] = (row - top) * column_count + column
                pixel_rows[position, 0], pixel_rows[position, 1] = _find_pixel_rows(
                    row, column, ellipse
                )
                position += 1
    return tiles, pixel_rows


@entry_kernel
def fill_tiles(order, pair_starts, tiles, pixel_rows, tile_count):
    """Return the list of Gaussians of every tile.

    Returns:
        `[T + 1]` start of each tile's list; `[P]` concatenated lists; `[P, 2]` pixel rows of the
        list entries; `[P]` position of each entry of `tiles` in the concatenated lists.
    """
    list_starts = np.zeros(tile_count + 1, dtype=np.int64)
    for tile in tiles:
        list_starts[tile + 1] += 1
    list_starts = np.cumsum(list_starts)
    next_positions = list_starts[:-1].copy()
    lists = np.empty(tiles.size, dtype=np.int32)
    listed_pixel_rows = np.empty_like(pixel_rows)
    positions = np.empty(tiles.size, dtype=np.int32)
    for i in order:
        for pair in range(pair_starts[i], pair_starts[i + 1]):
            position = next_positions[tiles[pair]]
            next_positions[tiles[pair]] = position + 1
            lists[position] = i
            listed_pixel_rows[position, 0], listed_pixel_rows[position, 1] = (
                pixel_rows[pair, 0],
                pixel_rows[pair, 1],
            )
            positions[pair] = position
    return list_starts, lists, listed_pixel_rows, positions
