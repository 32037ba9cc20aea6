"""Kernels for SSIM and its gradient, with an 11x11 Gaussian window of sigma 1.5.

Pictures are padded with zeros. 3DGS and its successors use this variant of SSIM; in reports, it has
the name `ssim_inria`. A picture is an array of rows of interleaved colors, so every loop runs over
contiguous memory, and neighboring pixels are three numbers apart. Each row is processed by one
thread, so results do not depend on the number of threads.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import fused_kernel, kernel, parallel_kernel

RADIUS = 5
BLOCK_SIZE = 64
_SIGMA = 1.5
_C1 = np.float32(0.01**2)
_C2 = np.float32(0.03**2)
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)


def _make_window() -> np.ndarray:
    weights = [math.exp(-(offset**2) / (2 * _SIGMA**2)) for offset in range(-RADIUS, RADIUS + 1)]
    return np.array([weight / sum(weights) for weight in weights], dtype=np.float32)


WINDOW = _make_window()


@fused_kernel
def _filter_along_x(padded, out):
    """Filter a row along x; the row is padded with 3 RADIUS zeros on each side."""
    for x in range(out.size):
        total = _0
        for k in range(2 * RADIUS + 1):
            total += WINDOW[k] * padded[x + 3 * k]
        out[x] = total


@fused_kernel
def _add_scaled(out, tap, row):
    for x in range(out.size):
        out[x] += tap * row[x]


@fused_kernel
def _add_scaled_product(out, tap, row, other_row):
    for x in range(out.size):
        out[x] += tap * row[x] * other_row[x]


@fused_kernel
def _filter_moments_along_y(picture, y, sums):
    """Filter a picture and its square along y into padded rows."""
    # Rows are sliced one by one, because the compiler does not know the stride of a 2D slice.
    start, stop = 3 * RADIUS, 3 * RADIUS + picture.shape[1]
    a, aa = sums[0][start:stop], sums[1][start:stop]
    for k in range(max(0, RADIUS - y), min(2 * RADIUS + 1, picture.shape[0] + RADIUS - y)):
        tap, picture_row = WINDOW[k], picture[y + k - RADIUS]
        _add_scaled(a, tap, picture_row)
        _add_scaled_product(aa, tap, picture_row, picture_row)


@fused_kernel
def _filter_product_along_y(first, second, y, out):
    """Filter the product of two pictures along y into a padded row."""
    ab = out[3 * RADIUS : 3 * RADIUS + first.shape[1]]
    for k in range(max(0, RADIUS - y), min(2 * RADIUS + 1, first.shape[0] + RADIUS - y)):
        _add_scaled_product(ab, WINDOW[k], first[y + k - RADIUS], second[y + k - RADIUS])


@kernel
def _copy(values, output):
    for x in range(values.size):
        output[x] = values[x]


@fused_kernel
def _compute_ssim_row(rows, block):
    """Compute the SSIM of a row, and the derivatives of SSIM with respect to a, aa and ab.

    The moments are copied to a block of fixed size, because the compiler does not vectorize
    loops over many arrays that may overlap.

    Args:
        rows: `[5, width]` filtered moments: first picture (a), its square (aa), product of both
            pictures (ab), second picture (b), its square (bb). SSIM and the three derivatives
            overwrite the first four rows.
        block: `[5 BLOCK_SIZE]` working memory.
    """
    for start in range(0, rows.shape[1], BLOCK_SIZE):
        size = min(BLOCK_SIZE, rows.shape[1] - start)
        for k in range(5):
            _copy(rows[k][start : start + size], block[k * BLOCK_SIZE : (k + 1) * BLOCK_SIZE])
        for x in range(BLOCK_SIZE):
            mean_a, mean_b = block[x], block[3 * BLOCK_SIZE + x]
            mean_a_squared, mean_b_squared, mean_product = (
                mean_a * mean_a,
                mean_b * mean_b,
                mean_a * mean_b,
            )
            numerator_1, numerator_2 = (
                _2 * mean_product + _C1,
                _2 * (block[2 * BLOCK_SIZE + x] - mean_product) + _C2,
            )
            denominator_1 = mean_a_squared + mean_b_squared + _C1
            denominator_2 = (
                block[BLOCK_SIZE + x]
                - mean_a_squared
                + block[4 * BLOCK_SIZE + x]
                - mean_b_squared
                + _C2
            )
            inverse_denominator = _1 / (denominator_1 * denominator_2)
            ssim = numerator_1 * numerator_2 * inverse_denominator
            derivative_ab = _2 * numerator_1 * inverse_denominator
            derivative_aa = -ssim * denominator_1 * inverse_denominator
            derivative_a = (
                _2
                * (
                    mean_b * numerator_2 * inverse_denominator
                    - mean_a * ssim * denominator_2 * inverse_denominator
                    - mean_a * derivative_aa
                )
                - mean_b * derivative_ab
            )
            block[x] = ssim
            block[BLOCK_SIZE + x] = derivative_a
            block[2 * BLOCK_SIZE + x] = derivative_aa
            block[3 * BLOCK_SIZE + x] = derivative_ab
        for k in range(4):
            _copy(block[k * BLOCK_SIZE : k * BLOCK_SIZE + size], rows[k][start : start + size])


@parallel_kernel
def ssim_moments(picture, moments):
    """Compute the moments of a picture: the filtered picture and its filtered square.

    Args:
        picture: `[H, 3 W]` picture.
        moments: `[2, H, 3 W]` output: the moments.
    """
    height, width = picture.shape
    for y in numba.prange(height):
        sums = np.zeros((2, width + 6 * RADIUS), dtype=np.float32)
        _filter_moments_along_y(picture, y, sums)
        for k in range(2):
            _filter_along_x(sums[k], moments[k, y])


@parallel_kernel
def ssim_forward(first, second, moments, ssim, derivatives):
    """Compute the SSIM of two pictures at every pixel and channel, and its derivatives.

    Args:
        first: `[H, 3 W]` first picture.
        second: `[H, 3 W]` second picture.
        moments: `[2, H, 3 W]` moments of the second picture from `ssim_moments`.
        ssim: `[H, 3 W]` output: SSIM of every pixel and channel.
        derivatives: `[3, H, 3 W]` output: derivatives of SSIM with respect to the filtered first
            picture, its filtered square and the filtered product of both pictures.
    """
    height, width = first.shape
    for y in numba.prange(height):
        sums = np.zeros((3, width + 6 * RADIUS), dtype=np.float32)
        rows = np.empty((5, width), dtype=np.float32)
        _filter_moments_along_y(first, y, sums)
        _filter_product_along_y(first, second, y, sums[2])
        for k in range(3):
            _filter_along_x(sums[k], rows[k])
        rows[3:] = moments[:, y]
        _compute_ssim_row(rows, np.ones(5 * BLOCK_SIZE, dtype=np.float32))
        ssim[y] = rows[0]
        derivatives[:, y] = rows[1:4]


@fused_kernel
def _filter_derivatives_along_y(derivatives, y, sums):
    sums[:] = 0
    height, width = derivatives.shape[1:]
    for index in range(3):
        out = sums[index][3 * RADIUS : 3 * RADIUS + width]
        for k in range(max(0, RADIUS - y), min(2 * RADIUS + 1, height + RADIUS - y)):
            _add_scaled(out, WINDOW[k], derivatives[index, y + k - RADIUS])


@parallel_kernel
def ssim_backward(first, second, derivatives, gradient):
    """Compute the `[H, 3 W]` gradient of the sum of SSIM with respect to the first picture."""
    height, width = first.shape
    for y in numba.prange(height):
        sums = np.empty((3, width + 6 * RADIUS), dtype=np.float32)
        rows = np.empty((3, width), dtype=np.float32)
        _filter_derivatives_along_y(derivatives, y, sums)
        for k in range(3):
            _filter_along_x(sums[k], rows[k])
        for x in range(width):
            linear, quadratic, cross = rows[0, x], rows[1, x], rows[2, x]
            gradient[y, x] = linear + _2 * first[y, x] * quadratic + second[y, x] * cross
