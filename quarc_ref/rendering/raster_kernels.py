"""Front-to-back compositing of a picture, tile by tile, forward and backward.

For each Gaussian of a tile's list the rows that its ellipse meets are gone
through with no branch inside a row, so that a row is a few vector operations.
A negative transmittance marks a pixel that has stopped. The backward pass goes
front to back too and takes the forward's decisions anew; of a pixel it carries
one number, what is still to come. Each pair of a tile and a Gaussian has its
own row of gradients, summed afterwards in a fixed order: the result does not
depend on the number of threads.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.binning_kernels import TILE, interval
from quarc_ref.rendering.compiled import fused, inlined, parallel_entrance, plain

ALPHA_MOST = np.float32(0.99)
ALPHA_LEAST = np.float32(1 / 255)
TRANSMITTANCE_LEAST = np.float32(1e-4)
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_HALF = np.float32(0.5)
_CHECK_EVERY = 16
# exp(-s) = p(s / 8)^8 on [0, 5.7], to 2e-6; beyond, alpha is below 1/255.
_MOST = np.float32(5.7)
_EIGHTH = np.float32(0.125)
_P5 = np.float32(-0.005805022083222866)
_P4 = np.float32(0.03970295563340187)
_P3 = np.float32(-0.16593335568904877)
_P2 = np.float32(0.4998728930950165)
_P1 = np.float32(-0.9999917149543762)
_P0 = np.float32(0.9999998807907104)


@inlined
def _falloff(s):
    s = s * _EIGHTH
    p = ((((_P5 * s + _P4) * s + _P3) * s + _P2) * s + _P1) * s + _P0
    p = p * p
    p = p * p
    return p * p


@inlined
def _alpha(s, opacity, t):
    """Return the alpha of a Gaussian at a pixel; 0 where it is skipped."""
    alpha = min(ALPHA_MOST, opacity * _falloff(s))
    alpha = alpha if alpha >= ALPHA_LEAST else _0
    alpha = alpha if (s >= _0) & (s <= _MOST) else _0
    return alpha if t > _0 else _0


@plain
def _rows_in_tile(x0, y0, i, means2d, conics, reaches):
    """Return the first row of a tile that a Gaussian meets, and the one after its last."""
    low = x0 + _HALF - means2d[i, 0]
    high = low + np.float32(TILE - 1)
    top, bottom = interval(conics[i, 2], conics[i, 1], conics[i, 0], reaches[i], low, high)
    if top > bottom:
        return 0, 0
    first = int(math.ceil(means2d[i, 1] + top - _HALF - y0))
    last = int(math.floor(means2d[i, 1] + bottom - _HALF - y0))
    return max(first, 0), min(last + 1, TILE)


@plain
def _all_stopped(rows):
    for y in range(TILE):
        for x in range(TILE):
            if rows[y, x] > _0:
                return False
    return True


@fused
def _composite(x0, y0, list_, means2d, conics, colors, opacities, reaches, rows):
    """Add the Gaussians of a tile's list to its rows.

    Args:
        rows: `[TILE, 4 TILE]` of each row transmittance, red, green, blue.
    """
    for k in range(list_.size):
        if k % _CHECK_EVERY == 0 and _all_stopped(rows):
            break
        i = list_[k]
        first, last = _rows_in_tile(x0, y0, i, means2d, conics, reaches)
        a, b, c = _HALF * conics[i, 0], conics[i, 1], _HALF * conics[i, 2]
        opacity, r, g, b_ = opacities[i], colors[i, 0], colors[i, 1], colors[i, 2]
        dx, dy = x0 + _HALF - means2d[i, 0], y0 + _HALF - means2d[i, 1]
        for y in range(first, last):
            row = rows[y]
            e = dy + np.float32(y)
            linear, constant = b * e, c * e * e
            for x in range(TILE):
                d = dx + np.float32(x)
                t = row[x]
                alpha = _alpha((a * d + linear) * d + constant, opacity, t)
                w = alpha * t
                after = t - w
                stops = (after <= TRANSMITTANCE_LEAST) & (alpha > _0)
                w = _0 if stops else w
                row[x] = -t if stops else after
                row[TILE + x] += w * r
                row[2 * TILE + x] += w * g
                row[3 * TILE + x] += w * b_


@parallel_entrance
def raster_forward(
    means2d, conics, colors, opacities, reaches, borders, lists, background, image, transmittance
):
    """Fill image [H,W,3] and transmittance [H,W], negative where a pixel stopped early."""
    height, width = transmittance.shape
    tiles_x = -(-width // TILE)
    for tile in numba.prange(borders.size - 1):
        row, column = tile // tiles_x * TILE, tile % tiles_x * TILE
        rows = np.zeros((TILE, 4 * TILE), dtype=np.float32)
        rows[:, :TILE] = _1
        list_ = lists[borders[tile] : borders[tile + 1]]
        x0, y0 = np.float32(column), np.float32(row)
        _composite(x0, y0, list_, means2d, conics, colors, opacities, reaches, rows)
        for y in range(min(TILE, height - row)):
            for x in range(min(TILE, width - column)):
                t = rows[y, x]
                transmittance[row + y, column + x] = t
                for k in range(3):
                    color = rows[y, (1 + k) * TILE + x]
                    image[row + y, column + x, k] = color + abs(t) * background[k]


@fused
def _composite_backward(x0, y0, list_, means2d, conics, colors, opacities, reaches, rows, pairs):
    """Fill the pairs' rows of gradients.

    Args:
        rows: `[TILE, 6 TILE]` of each row transmittance, 1; what is still to
            come, weighted by the gradient; gradients of red, green, blue, alpha.
        pairs: `[n, 9]` of the list: mean 2, conic 3, color 3, opacity.
    """
    lanes = np.empty(9 * TILE, dtype=np.float32)
    for k in range(list_.size):
        pairs[k] = _0
        if k % _CHECK_EVERY == 0 and _all_stopped(rows):
            pairs[k:] = _0
            break
        i = list_[k]
        first, last = _rows_in_tile(x0, y0, i, means2d, conics, reaches)
        a, b, c = _HALF * conics[i, 0], conics[i, 1], _HALF * conics[i, 2]
        opacity, r, g, b_ = opacities[i], colors[i, 0], colors[i, 1], colors[i, 2]
        dx, dy = x0 + _HALF - means2d[i, 0], y0 + _HALF - means2d[i, 1]
        lanes[:] = _0
        for y in range(first, last):
            row = rows[y]
            e = dy + np.float32(y)
            linear, constant = b * e, c * e * e
            for x in range(TILE):
                d = dx + np.float32(x)
                t = row[x]
                alpha = _alpha((a * d + linear) * d + constant, opacity, t)
                w = alpha * t
                after = t - w
                stops = (after <= TRANSMITTANCE_LEAST) & (alpha > _0)
                w = _0 if stops else w
                row[x] = -t if stops else after
                g_red, g_green = row[2 * TILE + x], row[3 * TILE + x]
                g_blue, g_alpha = row[4 * TILE + x], row[5 * TILE + x]
                value = r * g_red + g * g_green + b_ * g_blue + g_alpha
                rest = row[TILE + x] - w * value
                row[TILE + x] = rest
                # The gradient of the exponent: alpha's is t value - rest / (1 - alpha).
                q = alpha * rest / (_1 - alpha) - w * value
                q = _0 if stops | (alpha >= ALPHA_MOST) else q
                lanes[x] += q
                lanes[TILE + x] += q * d
                lanes[2 * TILE + x] += q * d * d
                lanes[3 * TILE + x] += q * e
                lanes[4 * TILE + x] += q * d * e
                lanes[5 * TILE + x] += q * e * e
                lanes[6 * TILE + x] += w * g_red
                lanes[7 * TILE + x] += w * g_green
                lanes[8 * TILE + x] += w * g_blue
        s, sx, sy = _sum_lanes(lanes, 0), _sum_lanes(lanes, 1), _sum_lanes(lanes, 3)
        pairs[k, 0] = -_2 * a * sx - b * sy
        pairs[k, 1] = -_2 * c * sy - b * sx
        pairs[k, 2] = _HALF * _sum_lanes(lanes, 2)
        pairs[k, 3] = _sum_lanes(lanes, 4)
        pairs[k, 4] = _HALF * _sum_lanes(lanes, 5)
        pairs[k, 5] = _sum_lanes(lanes, 6)
        pairs[k, 6] = _sum_lanes(lanes, 7)
        pairs[k, 7] = _sum_lanes(lanes, 8)
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
    means2d, conics, colors, opacities, reaches, borders, lists,
    image, transmittance, g_image, g_alpha,
):  # fmt: skip
    """Return `[P, 9]` the gradients of every pair: mean 2, conic 3, color 3, opacity."""
    height, width = transmittance.shape
    tiles_x = -(-width // TILE)
    pairs = np.empty((lists.size, 9), dtype=np.float32)
    for tile in numba.prange(borders.size - 1):
        row, column = tile // tiles_x * TILE, tile % tiles_x * TILE
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
        list_ = lists[borders[tile] : borders[tile + 1]]
        _composite_backward(
            np.float32(column), np.float32(row), list_,
            means2d, conics, colors, opacities, reaches, rows,
            pairs[borders[tile] : borders[tile + 1]],
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
