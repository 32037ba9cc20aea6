"""CPU kernels of the motion surrogate and of its gradients.

With torch operations, moving 20 000 Gaussians and computing the gradient of the motion would
take three times as long as rendering them. Each row is computed by one thread in a fixed
order, so the number of threads does not affect the result.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import kernel, parallel_kernel

_ONE = np.float32(1)
_LARGE = np.float32(1e18)  # the next product does not overflow, either


@parallel_kernel
def sum_levels(residuals, anchors, sums):
    """Compute `[N, c]` sums of residuals `[A, c]` over each Gaussian's anchors `[L, N]`."""
    for i in numba.prange(sums.shape[0]):
        for k in range(sums.shape[1]):
            sums[i, k] = residuals[anchors[0, i], k]
        for level in range(1, anchors.shape[0]):
            for k in range(sums.shape[1]):
                sums[i, k] += residuals[anchors[level, i], k]


@parallel_kernel
def sum_followers(gradients, followers, starts, sums):
    """Compute the `[A, c]` sums of gradients over the Gaussians bound to each anchor.

    Args:
        gradients: `[N, c]` gradients of the Gaussians.
        followers: `[L * N]` indices of the Gaussians bound to each anchor, sorted by anchor.
        starts: `[A + 1]` index in `followers` of the first Gaussian of each anchor.
        sums: `[A, c]` output.
    """
    for anchor in numba.prange(sums.shape[0]):
        for k in range(sums.shape[1]):
            sums[anchor, k] = 0
        for index in range(starts[anchor], starts[anchor + 1]):
            for k in range(sums.shape[1]):
                sums[anchor, k] += gradients[followers[index], k]


@kernel
def _multiply(a, b, sign_a, sign_b, out):
    """Write the Hamilton product of `a` and `b` to `out`; a factor with sign -1 is conjugated."""
    aw, ax, ay, az = a[0], sign_a * a[1], sign_a * a[2], sign_a * a[3]
    bw, bx, by, bz = b[0], sign_b * b[1], sign_b * b[2], sign_b * b[3]
    out[0] = aw * bw - ax * bx - ay * by - az * bz
    out[1] = aw * bx + ax * bw + ay * bz - az * by
    out[2] = aw * by - ax * bz + ay * bw + az * bx
    out[3] = aw * bz + ax * by - ay * bx + az * bw


@parallel_kernel
def multiply_quaternions(left, right, products):
    """Compute the `[N, 4]` Hamilton products of quaternions wxyz."""
    for i in numba.prange(left.shape[0]):
        _multiply(left[i], right[i], _ONE, _ONE, products[i])


@parallel_kernel
def multiply_quaternions_backward(left, right, gradients, left_gradients, right_gradients):
    """Compute the gradient of each factor: `gradients` times the conjugate of the other factor."""
    for i in numba.prange(left.shape[0]):
        _multiply(gradients[i], right[i], _ONE, -_ONE, left_gradients[i])
        _multiply(left[i], gradients[i], -_ONE, _ONE, right_gradients[i])


@parallel_kernel
def round_masked(values, limits, mask, rounded):
    """Clamp values `[N, k]` to limits `[k]` and round them; 0 outside the mask `[N, k]`."""
    for i in numba.prange(values.shape[0]):
        for k in range(values.shape[1]):
            value = min(max(values[i, k], -limits[k]), limits[k])
            rounded[i, k] = np.rint(value) if mask[i, k] else 0


@parallel_kernel
def round_masked_backward(values, limits, mask, gradients, value_gradients):
    """Compute the straight-through gradient: 0 beyond the limits and outside the mask."""
    for i in numba.prange(values.shape[0]):
        for k in range(values.shape[1]):
            has_gradient = mask[i, k] and -limits[k] <= values[i, k] <= limits[k]
            value_gradients[i, k] = gradients[i, k] if has_gradient else 0


@parallel_kernel
def log_norms(values, squared_norm_floor, logs, derivatives):
    """Compute ln(1 + norm) of each row, and its derivative divided by the norm.

    Args:
        values: `[N, k]` rows.
        squared_norm_floor: Value added to squared norms, so that the derivative is finite.
        logs: `[N]` output: ln(1 + norm).
        derivatives: `[N]` output: 1 / (norm (1 + norm)). The gradient of a row is the row
            multiplied by its item in `derivatives`.
    """
    for i in numba.prange(values.shape[0]):
        squared_norm = squared_norm_floor
        for k in range(values.shape[1]):
            squared_norm += values[i, k] * values[i, k]
        norm = math.sqrt(squared_norm)
        logs[i] = math.log1p(norm)
        derivatives[i] = _ONE / (norm * (_ONE + norm))


@parallel_kernel
def log_magnitudes(values, mask, logs, derivatives):
    """Compute the sum of ln(1 + magnitude) over the selected values of each row.

    A row needs one logarithm, that of the product.

    Args:
        values: `[N, k]` rows.
        mask: `[N, k]` mask of the selected values.
        logs: `[N]` output: the sums.
        derivatives: `[N, k]` output: the derivatives of the sums.
    """
    for i in numba.prange(values.shape[0]):
        logs[i] = 0
        product = _ONE
        for k in range(values.shape[1]):
            factor = _ONE + abs(values[i, k]) if mask[i, k] else _ONE
            derivatives[i, k] = np.sign(values[i, k]) / factor if mask[i, k] else 0
            product *= factor
            if product > _LARGE:
                logs[i] += math.log(product)
                product = _ONE
        logs[i] += math.log(product)
