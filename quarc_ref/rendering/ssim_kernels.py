"""Kernels for SSIM and its gradient: 11x11 Gaussian window of sigma 1.5, zero padding.

This is the variant of 3DGS and methods based on it, `ssim_inria` in reports. A picture is
processed as rows of interleaved colors, so that every loop runs over contiguous memory
and a step along x is three numbers. Each row is processed by one thread, so results do
not depend on the number of threads.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import fused, parallel_entrance, plain

RADIUS = 5
BLOCK = 64
_SIGMA = 1.5
_C1 = np.float32(0.01**2)
_C2 = np.float32(0.03**2)
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)


def _window() -> np.ndarray:
    taps = [math.exp(-(i**2) / (2 * _SIGMA**2)) for i in range(-RADIUS, RADIUS + 1)]
    return np.array([tap / sum(taps) for tap in taps], dtype=np.float32)


WINDOW = _window()


@fused
def _blur_along(padded, out):
    """Filter a row, padded by 3 RADIUS on both sides, along x."""
    for x in range(out.size):
        total = _0
        for k in range(2 * RADIUS + 1):
            total += WINDOW[k] * padded[x + 3 * k]
        out[x] = total


@fused
def _add(out, tap, row):
    for x in range(out.size):
        out[x] += tap * row[x]


@fused
def _add_product(out, tap, row, other):
    for x in range(out.size):
        out[x] += tap * row[x] * other[x]


@fused
def _moments_down(picture, y, sums):
    """Filter a picture and its square along y into padded rows."""
    # Slices of single rows, because the compiler would not know the stride of the whole array.
    start, stop = 3 * RADIUS, 3 * RADIUS + picture.shape[1]
    a, aa = sums[0][start:stop], sums[1][start:stop]
    for k in range(max(0, RADIUS - y), min(2 * RADIUS + 1, picture.shape[0] + RADIUS - y)):
        tap, p = WINDOW[k], picture[y + k - RADIUS]
        _add(a, tap, p)
        _add_product(aa, tap, p, p)


@fused
def _mixed_moment_down(first, second, y, out):
    """Filter the product of two pictures along y into a padded row."""
    ab = out[3 * RADIUS : 3 * RADIUS + first.shape[1]]
    for k in range(max(0, RADIUS - y), min(2 * RADIUS + 1, first.shape[0] + RADIUS - y)):
        _add_product(ab, WINDOW[k], first[y + k - RADIUS], second[y + k - RADIUS])


@plain
def _copy(source, target):
    for x in range(source.size):
        target[x] = source[x]


@fused
def _slopes(rows, block):
    """Compute the SSIM of a row and its derivatives by a, aa and ab from the moments.

    The moments a, aa, ab, b, bb are copied to a block of fixed size, because the compiler
    does not vectorize loops over many arrays that may overlap.

    Args:
        rows: `[5, width]`; the first four are overwritten.
        block: `[5 BLOCK]` working memory.
    """
    for start in range(0, rows.shape[1], BLOCK):
        size = min(BLOCK, rows.shape[1] - start)
        for k in range(5):
            _copy(rows[k][start : start + size], block[k * BLOCK : (k + 1) * BLOCK])
        for x in range(BLOCK):
            m, n = block[x], block[3 * BLOCK + x]
            mm, nn, mn = m * m, n * n, m * n
            top_1, top_2 = _2 * mn + _C1, _2 * (block[2 * BLOCK + x] - mn) + _C2
            low_1 = mm + nn + _C1
            low_2 = block[BLOCK + x] - mm + block[4 * BLOCK + x] - nn + _C2
            shared = _1 / (low_1 * low_2)
            value = top_1 * top_2 * shared
            by_ab = _2 * top_1 * shared
            by_aa = -value * low_1 * shared
            by_a = _2 * (n * top_2 * shared - m * value * low_2 * shared - m * by_aa) - n * by_ab
            block[x] = value
            block[BLOCK + x] = by_a
            block[2 * BLOCK + x] = by_aa
            block[3 * BLOCK + x] = by_ab
        for k in range(4):
            _copy(block[k * BLOCK : k * BLOCK + size], rows[k][start : start + size])


@parallel_entrance
def ssim_moments(picture, moments):
    """Compute `[2, H, 3 W]`: a filtered picture `[H, 3 W]` and its filtered square."""
    height, width = picture.shape
    for y in numba.prange(height):
        sums = np.zeros((2, width + 6 * RADIUS), dtype=np.float32)
        _moments_down(picture, y, sums)
        for k in range(2):
            _blur_along(sums[k], moments[k, y])


@parallel_entrance
def ssim_forward(first, second, moments, ssim, slopes):
    """Compute the SSIM of every number of two pictures, and its derivatives.

    Args:
        first: `[H, 3 W]` first picture.
        second: `[H, 3 W]` second picture.
        moments: `[2, H, 3 W]` moments of the second picture from `ssim_moments`.
        ssim: `[H, 3 W]` output.
        slopes: `[3, H, 3 W]` output: derivatives by the filtered first picture, its
            filtered square and the filtered product.
    """
    height, width = first.shape
    for y in numba.prange(height):
        sums = np.zeros((3, width + 6 * RADIUS), dtype=np.float32)
        rows = np.empty((5, width), dtype=np.float32)
        _moments_down(first, y, sums)
        _mixed_moment_down(first, second, y, sums[2])
        for k in range(3):
            _blur_along(sums[k], rows[k])
        rows[3:] = moments[:, y]
        _slopes(rows, np.ones(5 * BLOCK, dtype=np.float32))
        ssim[y] = rows[0]
        slopes[:, y] = rows[1:4]


@fused
def _slopes_down(slopes, y, sums):
    sums[:] = 0
    height, width = slopes.shape[1:]
    for map_ in range(3):
        out = sums[map_][3 * RADIUS : 3 * RADIUS + width]
        for k in range(max(0, RADIUS - y), min(2 * RADIUS + 1, height + RADIUS - y)):
            _add(out, WINDOW[k], slopes[map_, y + k - RADIUS])


@parallel_entrance
def ssim_backward(first, second, slopes, gradient):
    """Compute the `[H, 3 W]` gradient of the sum of the SSIM by the first picture."""
    height, width = first.shape
    for y in numba.prange(height):
        sums = np.empty((3, width + 6 * RADIUS), dtype=np.float32)
        rows = np.empty((3, width), dtype=np.float32)
        _slopes_down(slopes, y, sums)
        for k in range(3):
            _blur_along(sums[k], rows[k])
        for x in range(width):
            plain, squared, mixed = rows[0, x], rows[1, x], rows[2, x]
            gradient[y, x] = plain + _2 * first[y, x] * squared + second[y, x] * mixed
