"""Kernels of the motion surrogate on the CPU, each with its gradient.

A frame is trained with many small steps. As torch operations, moving 20 000 Gaussians and
its gradient take three times as long as rendering them. Every row is computed by one
thread in a fixed order, so the number of threads does not affect the result.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import parallel_entrance, plain

_1 = np.float32(1)


@parallel_entrance
def sum_levels(residuals, anchors, sums):
    """Compute `[N, c]` sums of residuals `[A, c]` over the anchors `[L, N]` of each Gaussian."""
    for i in numba.prange(sums.shape[0]):
        for k in range(sums.shape[1]):
            sums[i, k] = residuals[anchors[0, i], k]
        for level in range(1, anchors.shape[0]):
            for k in range(sums.shape[1]):
                sums[i, k] += residuals[anchors[level, i], k]


@parallel_entrance
def sum_followers(gradients, followers, starts, sums):
    """Compute `[A, c]` sums of `[N, c]` over the followers of each anchor.

    Args:
        gradients: `[N, c]` gradients of the Gaussians.
        followers: `[L N]` followers of all anchors, by anchor.
        starts: `[A + 1]` place of the first follower of each anchor.
        sums: `[A, c]` output.
    """
    for anchor in numba.prange(sums.shape[0]):
        for k in range(sums.shape[1]):
            sums[anchor, k] = 0
        for place in range(starts[anchor], starts[anchor + 1]):
            for k in range(sums.shape[1]):
                sums[anchor, k] += gradients[followers[place], k]


@plain
def _multiply(a, b, sign_a, sign_b, out):
    """Write the Hamilton product of two quaternions wxyz; a sign of -1 conjugates a factor."""
    aw, ax, ay, az = a[0], sign_a * a[1], sign_a * a[2], sign_a * a[3]
    bw, bx, by, bz = b[0], sign_b * b[1], sign_b * b[2], sign_b * b[3]
    out[0] = aw * bw - ax * bx - ay * by - az * bz
    out[1] = aw * bx + ax * bw + ay * bz - az * by
    out[2] = aw * by - ax * bz + ay * bw + az * bx
    out[3] = aw * bz + ax * by - ay * bx + az * bw


@parallel_entrance
def multiply_quaternions(left, right, products):
    """Compute the `[N, 4]` Hamilton products of quaternions wxyz."""
    for i in numba.prange(left.shape[0]):
        _multiply(left[i], right[i], _1, _1, products[i])


@parallel_entrance
def multiply_quaternions_backward(left, right, gradients, by_left, by_right):
    """Compute the gradients by both factors: the products with the conjugate of the other."""
    for i in numba.prange(left.shape[0]):
        _multiply(gradients[i], right[i], _1, -_1, by_left[i])
        _multiply(left[i], gradients[i], -_1, _1, by_right[i])


@parallel_entrance
def round_kept(values, limits, kept, rounded):
    """Round `[N, k]` to integers within limits `[k]`; rows that are not kept are 0."""
    for i in numba.prange(values.shape[0]):
        for k in range(values.shape[1]):
            value = min(max(values[i, k], -limits[k]), limits[k])
            rounded[i, k] = np.rint(value) if kept[i] else 0


@parallel_entrance
def round_kept_backward(values, limits, kept, gradients, by_values):
    """Compute the straight-through gradient, which is 0 beyond the limits."""
    for i in numba.prange(values.shape[0]):
        for k in range(values.shape[1]):
            passes = kept[i] and -limits[k] <= values[i, k] <= limits[k]
            by_values[i, k] = gradients[i, k] if passes else 0


@parallel_entrance
def log_norms(values, floor, logs, slopes):
    """Compute ln(1 + norm) of rows `[N, k]`, and its derivative by the norm over the norm.

    Args:
        values: `[N, k]` rows.
        floor: Added to squared norms, so that the derivative is finite.
        logs: `[N]` output.
        slopes: `[N]` output.
    """
    for i in numba.prange(values.shape[0]):
        total = floor
        for k in range(values.shape[1]):
            total += values[i, k] * values[i, k]
        norm = math.sqrt(total)
        logs[i] = math.log1p(norm)
        slopes[i] = _1 / (norm * (_1 + norm))
