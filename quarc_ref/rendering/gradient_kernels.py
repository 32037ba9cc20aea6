"""Kernels that compute the gradients of compositing, tile by tile.

The backward pass runs front to back and repeats the decisions of the forward pass. The backward
pass needs one additional number per pixel: the color of the Gaussians that are still to be blended,
weighted by the gradient. Each pair of a tile and a Gaussian has a row of gradients. The rows of a
Gaussian are summed in a fixed order, so the result does not depend on the number of threads.
"""

import numba
import numpy as np

from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.compiled import fused_kernel, kernel, parallel_kernel
from quarc_ref.rendering.raster_kernels import (
    MAX_ALPHA,
    OPACITY_CHECK_INTERVAL,
    choose_scatter_stride,
    compute_blend,
    is_tile_opaque,
)

_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_HALF = np.float32(0.5)


@fused_kernel
def _blend_fixed_gaussian(rows, first, end, dx, dy, conic, opacity, color):
    """Blend a Gaussian that needs no gradients into rows of a tile."""
    a, b, c = conic
    r, g, b_ = color
    for y in range(first, end):
        row = rows[y]
        e = dy + np.float32(y)
        linear, constant = b * e, c * e * e
        for x in range(TILE):
            d = dx + np.float32(x)
            t, remaining = row[x], row[TILE + x]
            color_term = r * row[2 * TILE + x] + g * row[3 * TILE + x] + b_ * row[4 * TILE + x]
            weight_gradient = color_term + row[5 * TILE + x]
            _, _, w, row[x] = compute_blend((a * d + linear) * d + constant, opacity, t)
            row[TILE + x] = remaining - w * weight_gradient


@fused_kernel
def _add_gradients(rows, first, end, dx, dy, conic, opacity, color, column_sums):
    """Blend a Gaussian into rows of a tile, and add its gradients to the column sums.

    Args:
        rows: State of all rows of the tile, as in `_composite_backward`; it is modified in place.
        first: First row into which the Gaussian is blended.
        end: End row (exclusive).
        dx: Horizontal offset of the tile's first column from the Gaussian's center.
        dy: Vertical offset of the tile's first row from the Gaussian's center.
        conic: Coefficients a / 2, b and c / 2 of the conic.
        opacity: Opacity of the Gaussian.
        color: Red, green, blue.
        column_sums: `[9 TILE]` nine sums over the rows for every column. The function adds to the
            first six: the sums of q, q e, q e^2 and of the gradients of red, green and blue. Here,
            q is the gradient of the exponent, and e is the vertical offset of the row from the
            Gaussian's center.
    """
    a, b, c = conic
    r, g, b_ = color
    for y in range(first, end):
        row = rows[y]
        e = dy + np.float32(y)
        linear, constant = b * e, c * e * e
        for x in range(TILE):
            d = dx + np.float32(x)
            t, remaining = row[x], row[TILE + x]
            g_red, g_green, g_blue = row[2 * TILE + x], row[3 * TILE + x], row[4 * TILE + x]
            weight_gradient = r * g_red + g * g_green + b_ * g_blue + row[5 * TILE + x]
            s = (a * d + linear) * d + constant
            alpha, is_blended, w, row[x] = compute_blend(s, opacity, t)
            remaining = remaining - w * weight_gradient
            row[TILE + x] = remaining
            # q is the gradient of the exponent; the gradient of alpha is
            # t weight_gradient - remaining / (1 - alpha).
            q = alpha * remaining / (_1 - alpha) - w * weight_gradient
            q = q if is_blended & (alpha < MAX_ALPHA) else _0
            qe = q * e
            column_sums[x] += q
            column_sums[TILE + x] += qe
            column_sums[2 * TILE + x] += qe * e
            column_sums[3 * TILE + x] += w * g_red
            column_sums[4 * TILE + x] += w * g_green
            column_sums[5 * TILE + x] += w * g_blue


@fused_kernel
def _finish_gradients(column_sums, dx, conic, opacity, gradients):
    """Compute a pair's gradients from column sums: mean (2), conic (3), color (3), opacity (1)."""
    a, b, c = conic
    for x in range(TILE):
        d = dx + np.float32(x)
        column_sums[6 * TILE + x] = column_sums[x] * d
        column_sums[7 * TILE + x] = column_sums[x] * d * d
        column_sums[8 * TILE + x] = column_sums[TILE + x] * d
    sx, sy = _sum_columns(column_sums, 6), _sum_columns(column_sums, 1)
    gradients[8] = -_sum_columns(column_sums, 0) / opacity
    gradients[0] = -_2 * a * sx - b * sy
    gradients[1] = -_2 * c * sy - b * sx
    gradients[2] = _HALF * _sum_columns(column_sums, 7)
    gradients[3] = _sum_columns(column_sums, 8)
    gradients[4] = _HALF * _sum_columns(column_sums, 2)
    for k in range(3):
        gradients[5 + k] = _sum_columns(column_sums, 3 + k)


@fused_kernel
def _composite_backward(
    x0,
    y0,
    indices,
    pixel_rows,
    fixed_count,
    means2d,
    conics,
    colors,
    opacities,
    rows,
    pair_gradients,
):
    """Compute the gradients of a tile's pairs; the rows of fixed Gaussians remain undefined.

    The rows of a tile are processed in separate functions, because the compiler does not
    always vectorize loops in longer functions.

    Args:
        pixel_rows: `[n, 2]` first and end row (exclusive) that each Gaussian intersects.
        fixed_count: Number of fixed Gaussians, which have the lowest indices and no gradients.
        rows: `[TILE, 6 TILE]` state of each row: the transmittance, initially 1; the remaining
            color, weighted by the gradient; the gradients of red, green, blue and alpha.
        pair_gradients: `[n, 9]` output: gradients of mean (2), conic (3), color (3), opacity (1).
    """
    column_sums = np.empty(9 * TILE, dtype=np.float32)
    entry_count = indices.size
    while entry_count > 0 and indices[entry_count - 1] < fixed_count:
        entry_count -= 1
    for k in range(entry_count):
        if k % OPACITY_CHECK_INTERVAL == 0 and is_tile_opaque(rows):
            pair_gradients[k:] = _0
            break
        i = indices[k]
        first, end = pixel_rows[k, 0], pixel_rows[k, 1]
        conic = _HALF * conics[i, 0], conics[i, 1], _HALF * conics[i, 2]
        color = colors[i, 0], colors[i, 1], colors[i, 2]
        dx, dy = x0 + _HALF - means2d[i, 0], y0 + _HALF - means2d[i, 1]
        if i < fixed_count:
            _blend_fixed_gaussian(rows, first, end, dx, dy, conic, opacities[i], color)
        else:
            column_sums[:] = _0
            _add_gradients(rows, first, end, dx, dy, conic, opacities[i], color, column_sums)
            _finish_gradients(column_sums, dx, conic, opacities[i], pair_gradients[k])


@kernel
def _sum_columns(column_sums, k):
    """Return the sum of row k of the column sums; the pairwise summation overwrites the row."""
    row = column_sums[k * TILE : (k + 1) * TILE]
    for x in range(8):
        row[x] += row[x + 8]
    for x in range(4):
        row[x] += row[x + 4]
    return (row[0] + row[2]) + (row[1] + row[3])


@parallel_kernel
def raster_backward(
    means2d, conics, colors, opacities, tile_ids, list_starts, lists, pixel_rows, fixed_count,
    image, transmittance, g_image, g_alpha,
):  # fmt: skip
    """Return the `[P, 9]` gradients of the pairs: mean (2), conic (3), color (3), opacity (1).

    Rows of the first `fixed_count` Gaussians are undefined.
    """
    height, width = transmittance.shape
    column_count = -(-width // TILE)
    pair_gradients = np.empty((lists.size, 9), dtype=np.float32)
    stride = choose_scatter_stride(tile_ids.size)
    for index in numba.prange(tile_ids.size):
        tile = index * stride % tile_ids.size
        tile_top, tile_left = (
            tile_ids[tile] // column_count * TILE,
            tile_ids[tile] % column_count * TILE,
        )
        rows = np.zeros((TILE, 6 * TILE), dtype=np.float32)
        for y in range(min(TILE, height - tile_top)):
            for x in range(min(TILE, width - tile_left)):
                rows[y, x] = _1
                g = g_alpha[tile_top + y, tile_left + x]
                rows[y, 5 * TILE + x] = g
                rows[y, TILE + x] = g * (_1 - abs(transmittance[tile_top + y, tile_left + x]))
                for k in range(3):
                    g = g_image[tile_top + y, tile_left + x, k]
                    rows[y, (2 + k) * TILE + x] = g
                    rows[y, TILE + x] += g * image[tile_top + y, tile_left + x, k]
        begin, end = list_starts[tile], list_starts[tile + 1]
        _composite_backward(
            np.float32(tile_left), np.float32(tile_top), lists[begin:end], pixel_rows[begin:end],
            fixed_count, means2d, conics, colors, opacities, rows, pair_gradients[begin:end],
        )  # fmt: skip
    return pair_gradients


@parallel_kernel
def sum_pair_gradients(
    pair_gradients, pair_starts, pair_positions, g_means2d, g_conics, g_colors, g_opacities
):
    """Sum the gradients of each Gaussian's pairs in the order of its tiles."""
    for i in numba.prange(g_opacities.size):
        total = np.zeros(9, dtype=np.float32)
        for pair in range(pair_starts[i], pair_starts[i + 1]):
            total += pair_gradients[pair_positions[pair]]
        g_means2d[i, 0], g_means2d[i, 1] = total[0], total[1]
        for k in range(3):
            g_conics[i, k], g_colors[i, k] = total[2 + k], total[5 + k]
        g_opacities[i] = total[8]
