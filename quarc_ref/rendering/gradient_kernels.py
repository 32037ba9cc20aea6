"""The gradients of compositing, tile by tile.

The backward pass goes front to back as the forward pass does and takes its
decisions anew; of a pixel it carries one number, what is still to come. Each pair
of a tile and a Gaussian has its own row of gradients, summed afterwards in a fixed
order: the result does not depend on the number of threads.
"""

import numba
import numpy as np

from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.compiled import fused, inlined, parallel_entrance, plain
from quarc_ref.rendering.raster_kernels import (
    ALPHA_MOST,
    CHECK_EVERY,
    all_stopped,
    scattering_step,
    weigh,
)

_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_HALF = np.float32(0.5)


@inlined
def _go_past(row, x, s, opacity, r, g, b_):
    """Take a pixel of the backward pass past a Gaussian.

    Args:
        row: As `_composite_backward` has it; changed.
        x: Of the pixel.
        s: Exponent of the Gaussian there.
        opacity: Of the Gaussian.
        r: Its red.
        g: Its green.
        b_: Its blue.

    Returns:
        Alpha, whether it counts, its weight, the gradient by the weight, and
        what is still to come.
    """
    alpha, counts, w, row[x] = weigh(s, opacity, row[x])
    colors = r * row[2 * TILE + x] + g * row[3 * TILE + x] + b_ * row[4 * TILE + x]
    value = colors + row[5 * TILE + x]
    rest = row[TILE + x] - w * value
    row[TILE + x] = rest
    return alpha, counts, w, value, rest


@fused
def _composite_backward(x0, y0, list_, met, fixed, means2d, conics, colors, opacities, rows, pairs):
    """Fill the pairs' rows of gradients, but for those of the first, fixed Gaussians.

    Args:
        met: `[n, 2]` the rows that each Gaussian of the list meets.
        fixed: Number of Gaussians that have no gradient.
        rows: `[TILE, 6 TILE]` of each row transmittance, 1; what is still to
            come, weighted by the gradient; gradients of red, green, blue, alpha.
        pairs: `[n, 9]` of the list: mean 2, conic 3, color 3, opacity.
    """
    lanes = np.empty(9 * TILE, dtype=np.float32)
    size = list_.size
    while size > 0 and list_[size - 1] < fixed:
        size -= 1
    for k in range(size):
        pairs[k] = _0
        if k % CHECK_EVERY == 0 and all_stopped(rows):
            pairs[k:] = _0
            break
        i = list_[k]
        first, last = met[k, 0], met[k, 1]
        a, b, c = _HALF * conics[i, 0], conics[i, 1], _HALF * conics[i, 2]
        opacity, r, g, b_ = opacities[i], colors[i, 0], colors[i, 1], colors[i, 2]
        dx, dy = x0 + _HALF - means2d[i, 0], y0 + _HALF - means2d[i, 1]
        if i < fixed:
            for y in range(first, last):
                row = rows[y]
                e = dy + np.float32(y)
                linear, constant = b * e, c * e * e
                for x in range(TILE):
                    d = dx + np.float32(x)
                    _go_past(row, x, (a * d + linear) * d + constant, opacity, r, g, b_)
            continue
        lanes[:] = _0
        for y in range(first, last):
            row = rows[y]
            e = dy + np.float32(y)
            linear, constant = b * e, c * e * e
            for x in range(TILE):
                d = dx + np.float32(x)
                s = (a * d + linear) * d + constant
                alpha, counts, w, value, rest = _go_past(row, x, s, opacity, r, g, b_)
                # The gradient of the exponent: alpha's is t value - rest / (1 - alpha).
                q = alpha * rest / (_1 - alpha) - w * value
                q = q if counts & (alpha < ALPHA_MOST) else _0
                qe = q * e
                lanes[x] += q
                lanes[TILE + x] += qe
                lanes[2 * TILE + x] += qe * e
                lanes[3 * TILE + x] += w * row[2 * TILE + x]
                lanes[4 * TILE + x] += w * row[3 * TILE + x]
                lanes[5 * TILE + x] += w * row[4 * TILE + x]
        # What depends on the column alone is left for here.
        for x in range(TILE):
            d = dx + np.float32(x)
            lanes[6 * TILE + x] = lanes[x] * d
            lanes[7 * TILE + x] = lanes[x] * d * d
            lanes[8 * TILE + x] = lanes[TILE + x] * d
        s, sx, sy = _sum_lanes(lanes, 0), _sum_lanes(lanes, 6), _sum_lanes(lanes, 1)
        pairs[k, 0] = -_2 * a * sx - b * sy
        pairs[k, 1] = -_2 * c * sy - b * sx
        pairs[k, 2] = _HALF * _sum_lanes(lanes, 7)
        pairs[k, 3] = _sum_lanes(lanes, 8)
        pairs[k, 4] = _HALF * _sum_lanes(lanes, 2)
        pairs[k, 5] = _sum_lanes(lanes, 3)
        pairs[k, 6] = _sum_lanes(lanes, 4)
        pairs[k, 7] = _sum_lanes(lanes, 5)
        pairs[k, 8] = -s / opacity


@plain
def _sum_lanes(lanes, k):
    """Return the sum of the k-th row of lanes, added up by halves."""
    row = lanes[k * TILE : (k + 1) * TILE]
    for x in range(8):
        row[x] += row[x + 8]
    for x in range(4):
        row[x] += row[x + 4]
    return (row[0] + row[2]) + (row[1] + row[3])


@parallel_entrance
def raster_backward(
    means2d, conics, colors, opacities, which, borders, lists, met_rows, fixed,
    image, transmittance, g_image, g_alpha,
):  # fmt: skip
    """Return `[P, 9]` the gradients of the pairs: mean 2, conic 3, color 3, opacity.

    The rows of the first, `fixed` Gaussians mean nothing.
    """
    height, width = transmittance.shape
    tiles_x = -(-width // TILE)
    pairs = np.empty((lists.size, 9), dtype=np.float32)
    step = scattering_step(which.size)
    for turn in numba.prange(which.size):
        tile = turn * step % which.size
        row, column = which[tile] // tiles_x * TILE, which[tile] % tiles_x * TILE
        rows = np.zeros((TILE, 6 * TILE), dtype=np.float32)
        for y in range(min(TILE, height - row)):
            for x in range(min(TILE, width - column)):
                rows[y, x] = _1
                g = g_alpha[row + y, column + x]
                rows[y, 5 * TILE + x] = g
                rows[y, TILE + x] = g * (_1 - abs(transmittance[row + y, column + x]))
                for k in range(3):
                    g = g_image[row + y, column + x, k]
                    rows[y, (2 + k) * TILE + x] = g
                    rows[y, TILE + x] += g * image[row + y, column + x, k]
        begin, end = borders[tile], borders[tile + 1]
        _composite_backward(
            np.float32(column), np.float32(row), lists[begin:end], met_rows[begin:end], fixed,
            means2d, conics, colors, opacities, rows, pairs[begin:end],
        )  # fmt: skip
    return pairs


@parallel_entrance
def gather_pairs(pairs, starts, places, g_means2d, g_conics, g_colors, g_opacities):
    """Sum the pairs of each Gaussian, in the order of its tiles."""
    for i in numba.prange(g_opacities.size):
        total = np.zeros(9, dtype=np.float32)
        for pair in range(starts[i], starts[i + 1]):
            total += pairs[places[pair]]
        g_means2d[i, 0], g_means2d[i, 1] = total[0], total[1]
        for k in range(3):
            g_conics[i, k], g_colors[i, k] = total[2 + k], total[5 + k]
        g_opacities[i] = total[8]
