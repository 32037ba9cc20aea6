"""Kernels for front-to-back compositing, by tile.

For each Gaussian of a tile's list, the rows that its ellipse intersects are processed
without branches inside a row, so that each row takes a few vector operations. A negative
transmittance marks a pixel that is opaque and no longer changes.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.compiled import fused, inlined, parallel_entrance, plain

MAX_ALPHA = np.float32(0.99)
MIN_ALPHA = np.float32(1 / 255)
MIN_TRANSMITTANCE = np.float32(1e-4)
CHECK_EVERY = 16  # number of Gaussians of a list
_0 = np.float32(0)
_1 = np.float32(1)
_HALF = np.float32(0.5)
_GOLDEN = 0.618
# exp(-s) = p(s / 8)^8 on [0, 5.7] with an error of 2e-6; above, alpha is below 1/255.
_MAXIMUM = np.float32(5.7)
_P5 = np.float32(-0.005805022083222866 / 8**5)
_P4 = np.float32(0.03970295563340187 / 8**4)
_P3 = np.float32(-0.16593335568904877 / 8**3)
_P2 = np.float32(0.4998728930950165 / 8**2)
_P1 = np.float32(-0.9999917149543762 / 8)
_P0 = np.float32(0.9999998807907104)


@inlined
def _falloff(s):
    square = s * s
    p = ((_P5 * s + _P4) * square + (_P3 * s + _P2)) * square + (_P1 * s + _P0)
    p = p * p
    p = p * p
    return p * p


@inlined
def blend_weight(s, opacity, t):
    """Return alpha of a Gaussian at a pixel, whether it is used, its weight, and the new t.

    The t of an opaque pixel is kept but made negative.
    """
    alpha = min(MAX_ALPHA, opacity * _falloff(s))
    drawn = (alpha >= MIN_ALPHA) & (s >= _0) & (s <= _MAXIMUM)
    w = alpha * t
    after = t - w
    counts = drawn & (after > MIN_TRANSMITTANCE)
    held = -abs(t) if drawn else t
    return alpha, counts, w if counts else _0, after if counts else held


@plain
def all_opaque(rows):
    """Return whether all pixels of a tile are opaque."""
    for y in range(TILE):
        for x in range(TILE):
            if rows[y, x] > _0:
                return False
    return True


@fused
def _composite(x0, y0, list_, met, means2d, conics, colors, opacities, rows):
    """Add the Gaussians of a tile's list to its rows.

    Args:
        met: `[n, 2]` rows that each Gaussian of the list intersects.
        rows: `[TILE, 4 TILE]` transmittance, red, green and blue of each row.
    """
    for k in range(list_.size):
        if k % CHECK_EVERY == 0 and all_opaque(rows):
            break
        i = list_[k]
        first, last = met[k, 0], met[k, 1]
        a, b, c = _HALF * conics[i, 0], conics[i, 1], _HALF * conics[i, 2]
        opacity, r, g, b_ = opacities[i], colors[i, 0], colors[i, 1], colors[i, 2]
        dx, dy = x0 + _HALF - means2d[i, 0], y0 + _HALF - means2d[i, 1]
        for y in range(first, last):
            row = rows[y]
            e = dy + np.float32(y)
            linear, constant = b * e, c * e * e
            for x in range(TILE):
                d = dx + np.float32(x)
                s = (a * d + linear) * d + constant
                _, _, w, row[x] = blend_weight(s, opacity, row[x])
                row[TILE + x] += w * r
                row[2 * TILE + x] += w * g
                row[3 * TILE + x] += w * b_


@plain
def scatter_stride(count):
    """Return a step that visits all of `count` tiles in a scattered order.

    Threads get consecutive ranges, which would otherwise differ much in work.
    """
    step = int(_GOLDEN * count) + 1
    while math.gcd(step, count) > 1:
        step += 1
    return step


@plain
def _load_rows(rows, image, transmittance, row, column):
    """Load the rows of a tile with the state after earlier slices."""
    height, width = transmittance.shape
    rows[:, :TILE] = -_1  # pixels outside the picture are opaque
    for y in range(min(TILE, height - row)):
        for x in range(min(TILE, width - column)):
            rows[y, x] = transmittance[row + y, column + x]
            for k in range(3):
                rows[y, (1 + k) * TILE + x] = image[row + y, column + x, k]


@parallel_entrance
def raster_forward(
    means2d, conics, colors, opacities,
    which, borders, lists, pair_rows, background, continues, top, image, transmittance,
):  # fmt: skip
    """Composite tiles into image [H,W,3] and transmittance [H,W] (negative if opaque).

    Tiles are counted along the rows of the whole picture, in which the first row of the
    image is `top`. With `continues`, Gaussians are added behind existing content, on black.
    """
    height, width = transmittance.shape
    tiles_x = -(-width // TILE)
    step = scatter_stride(which.size)
    for turn in numba.prange(which.size):
        tile = turn * step % which.size
        row, column = which[tile] // tiles_x * TILE, which[tile] % tiles_x * TILE
        rows = np.zeros((TILE, 4 * TILE), dtype=np.float32)
        rows[:, :TILE] = _1
        first = row - top
        if continues:
            _load_rows(rows, image, transmittance, first, column)
        begin, end = borders[tile], borders[tile + 1]
        list_, met = lists[begin:end], pair_rows[begin:end]
        x0, y0 = np.float32(column), np.float32(row)
        _composite(x0, y0, list_, met, means2d, conics, colors, opacities, rows)
        for y in range(min(TILE, height - first)):
            for x in range(min(TILE, width - column)):
                t = rows[y, x]
                transmittance[first + y, column + x] = t
                for k in range(3):
                    color = rows[y, (1 + k) * TILE + x]
                    image[first + y, column + x, k] = color + abs(t) * background[k]
