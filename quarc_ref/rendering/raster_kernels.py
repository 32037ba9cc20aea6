"""Kernels that composite Gaussians from front to back, tile by tile.

For each Gaussian of a tile's list, the kernels process the rows that its ellipse intersects. The
code for a row has no branches, so it compiles to a few vector operations. A negative transmittance
marks an opaque pixel, which no longer changes.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.compiled import fused_kernel, inlined_kernel, kernel, parallel_kernel

MAX_ALPHA = np.float32(0.99)
MIN_ALPHA = np.float32(1 / 255)
MIN_TRANSMITTANCE = np.float32(1e-4)
OPACITY_CHECK_INTERVAL = 16  # Gaussians blended between two checks of whether a tile is opaque
_0 = np.float32(0)
_1 = np.float32(1)
_HALF = np.float32(0.5)
_GOLDEN_RATIO = 0.618
# exp(-s) = p(s / 8)^8 on [0, 5.7] with an error of 2e-6; for larger s, alpha is below 1/255.
_MAX_EXPONENT = np.float32(5.7)
_P5 = np.float32(-0.005805022083222866 / 8**5)
_P4 = np.float32(0.03970295563340187 / 8**4)
_P3 = np.float32(-0.16593335568904877 / 8**3)
_P2 = np.float32(0.4998728930950165 / 8**2)
_P1 = np.float32(-0.9999917149543762 / 8)
_P0 = np.float32(0.9999998807907104)


@inlined_kernel
def _compute_falloff(s):
    square = s * s
    p = ((_P5 * s + _P4) * square + (_P3 * s + _P2)) * square + (_P1 * s + _P0)
    p = p * p
    p = p * p
    return p * p


@inlined_kernel
def compute_blend(s, opacity, t):
    """Return a Gaussian's alpha, whether it is blended, its weight, and the new transmittance.

    The transmittance t of a pixel that becomes opaque keeps its absolute value, but its sign
    becomes negative.
    """
    alpha = min(MAX_ALPHA, opacity * _compute_falloff(s))
    is_drawn = (alpha >= MIN_ALPHA) & (s >= _0) & (s <= _MAX_EXPONENT)
    w = alpha * t
    new_t = t - w
    is_blended = is_drawn & (new_t > MIN_TRANSMITTANCE)
    unblended_t = -abs(t) if is_drawn else t
    return alpha, is_blended, w if is_blended else _0, new_t if is_blended else unblended_t


@kernel
def is_tile_opaque(rows):
    """Return whether all pixels of a tile are opaque, that is, have no positive transmittance."""
    for y in range(TILE):
        for x in range(TILE):
            if rows[y, x] > _0:
                return False
    return True


@fused_kernel
def _composite(x0, y0, indices, pixel_rows, means2d, conics, colors, opacities, rows):
    """Blend the Gaussians of a tile's list into the rows of the tile.

    Args:
        pixel_rows: `[n, 2]` first and end row (exclusive) that each Gaussian intersects.
        rows: `[TILE, 4 TILE]` transmittance, red, green and blue of each row.
    """
    for k in range(indices.size):
        if k % OPACITY_CHECK_INTERVAL == 0 and is_tile_opaque(rows):
            break
        i = indices[k]
        first, end = pixel_rows[k, 0], pixel_rows[k, 1]
        a, b, c = _HALF * conics[i, 0], conics[i, 1], _HALF * conics[i, 2]
        opacity, r, g, b_ = opacities[i], colors[i, 0], colors[i, 1], colors[i, 2]
        dx, dy = x0 + _HALF - means2d[i, 0], y0 + _HALF - means2d[i, 1]
        for y in range(first, end):
            row = rows[y]
            e = dy + np.float32(y)
            linear, constant = b * e, c * e * e
            for x in range(TILE):
                d = dx + np.float32(x)
                s = (a * d + linear) * d + constant
                _, _, w, row[x] = compute_blend(s, opacity, row[x])
                row[TILE + x] += w * r
                row[2 * TILE + x] += w * g
                row[3 * TILE + x] += w * b_


@kernel
def choose_scatter_stride(tile_count):
    """Return a stride with which all `tile_count` tiles are visited in a scattered order.

    Each thread processes consecutive indices. If these were neighboring tiles, some threads
    would have much more work than others.
    """
    stride = int(_GOLDEN_RATIO * tile_count) + 1
    while math.gcd(stride, tile_count) > 1:
        stride += 1
    return stride


@kernel
def _load_rows(rows, image, transmittance, first_row, first_column):
    """Load the rows of a tile from the picture, which already contains the earlier slices."""
    height, width = transmittance.shape
    rows[:, :TILE] = -_1  # pixels outside the picture are opaque
    for y in range(min(TILE, height - first_row)):
        for x in range(min(TILE, width - first_column)):
            rows[y, x] = transmittance[first_row + y, first_column + x]
            for k in range(3):
                rows[y, (1 + k) * TILE + x] = image[first_row + y, first_column + x, k]


@parallel_kernel
def raster_forward(
    means2d, conics, colors, opacities,
    tile_ids, list_starts, lists, pixel_rows,
    background, is_continuation, top, image, transmittance,
):  # fmt: skip
    """Composite tiles into image [H,W,3] and transmittance [H,W] (negative if opaque).

    Tiles are counted row by row in the whole picture; the first row of the image is row `top`
    of the whole picture. With `is_continuation`, Gaussians are added behind the existing
    content, and the background must be black.
    """
    height, width = transmittance.shape
    column_count = -(-width // TILE)
    stride = choose_scatter_stride(tile_ids.size)
    for index in numba.prange(tile_ids.size):
        tile = index * stride % tile_ids.size
        tile_top, tile_left = (
            tile_ids[tile] // column_count * TILE,
            tile_ids[tile] % column_count * TILE,
        )
        rows = np.zeros((TILE, 4 * TILE), dtype=np.float32)
        rows[:, :TILE] = _1
        first_row = tile_top - top
        if is_continuation:
            _load_rows(rows, image, transmittance, first_row, tile_left)
        begin, end = list_starts[tile], list_starts[tile + 1]
        indices, tile_pixel_rows = lists[begin:end], pixel_rows[begin:end]
        x0, y0 = np.float32(tile_left), np.float32(tile_top)
        _composite(x0, y0, indices, tile_pixel_rows, means2d, conics, colors, opacities, rows)
        for y in range(min(TILE, height - first_row)):
            for x in range(min(TILE, width - tile_left)):
                t = rows[y, x]
                transmittance[first_row + y, tile_left + x] = t
                for k in range(3):
                    color = rows[y, (1 + k) * TILE + x]
                    image[first_row + y, tile_left + x, k] = color + abs(t) * background[k]
