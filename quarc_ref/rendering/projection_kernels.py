"""Kernels that project Gaussians (EWA, SH degree 1).

Each Gaussian is processed by one thread and shares no data with others, so the number of threads
does not affect the result. `projection_gradient_kernels` has the backward pass. SPEC 10.3 defines
the conventions: pixel centers are at +0.5, and a low-pass filter is added to the diagonal of
covariances. For the Jacobian, but not elsewhere, x/z and y/z are clamped to the picture plus a
margin.

A camera is an array of 28 numbers: rotation (9), translation (3), fx, fy, cx, cy, width, height,
nearest depth, center (3), low-pass filter in x and y (variances in pixels), minimum and maximum of
the clamped x/z, minimum and maximum of the clamped y/z.

Threads process blocks of Gaussians: numba counts references to arrays in each call that is not
inlined, so a call per Gaussian would add a third to the time.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import inlined_kernel, kernel, parallel_kernel
from quarc_ref.rendering.matrix_kernels import (
    multiply_matrices,
    multiply_vector,
)

MIN_ALPHA = np.float32(1 / 255)
# Copies of SPEC 3.1: kernels import no constants, because numba would not compile them again
# after a change.
SH_C0 = np.float32(0.28209479177387814)
SH_C1 = np.float32(0.4886025119029199)
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_3 = np.float32(3)
_HALF = np.float32(0.5)
BLOCK_SIZE = 256  # Gaussians per call of a kernel
# Squared distance from the center, in standard deviations, beyond which alpha is below 1/255 for
# every opacity, plus 1 % for rounding errors.
_MAX_SQUARED_EXTENT = np.float32(1.01 * 2 * math.log(255))


@parallel_kernel
def project_forward(
    camera, means, quaternions, scales, opacities, sh,
    means2d, conics, colors, depths, max_exponents, radii,
):  # fmt: skip
    """Compute means2d [N,2], conics [N,3], colors [N,3], depths, max_exponents and radii [N].

    The maximum exponent is the exponent at which the alpha of a Gaussian is 1/255, or 0 for
    invisible Gaussians. The radius is three standard deviations, in pixels. Gaussians with
    non-finite numbers are invisible, because NaN fails all comparisons.
    """
    count = means.shape[0]
    for block in numba.prange(-(-count // BLOCK_SIZE)):
        first = block * BLOCK_SIZE
        _project_block(
            first, min(first + BLOCK_SIZE, count), camera,
            means, quaternions, scales, opacities, sh,
            means2d, conics, colors, depths, max_exponents, radii,
        )  # fmt: skip


@kernel
def _project_block(
    first, end, camera, means, quaternions, scales, opacities, sh,
    means2d, conics, colors, depths, max_exponents, radii,
):  # fmt: skip
    """Project the Gaussians from `first` to `end` - 1; see `project_forward`."""
    for i in range(first, end):
        max_exponents[i] = _0
        x, y, z = to_camera(camera, means, i)
        if not (camera[18] < z < np.inf and opacities[i] > MIN_ALPHA):
            continue
        inverse_z = _1 / z
        u, v = camera[12] * x * inverse_z + camera[14], camera[13] * y * inverse_z + camera[15]
        if not _may_be_visible(camera, scales, i, x, y, inverse_z, u, v):
            continue
        rotation = compute_rotation_matrix(quaternions, i)
        a, b, c = _covariance(camera, rotation, scales, i, x, y, inverse_z)
        det = a * c - b * b
        if not _0 < det < np.inf:
            continue
        max_exponent = math.log(opacities[i] / MIN_ALPHA)
        if not _overlaps_range(u, math.sqrt(_2 * max_exponent * a), camera[16]):
            continue
        if not _overlaps_range(v, math.sqrt(_2 * max_exponent * c), camera[17]):
            continue
        _shade(camera, means, sh, colors, i)
        if not math.isfinite(colors[i, 0] + colors[i, 1] + colors[i, 2]):
            continue
        max_exponents[i], depths[i] = max_exponent, z
        mean_variance = _HALF * (a + c)
        radii[i] = _3 * math.sqrt(
            mean_variance + math.sqrt(max(_0, mean_variance * mean_variance - det))
        )
        means2d[i, 0], means2d[i, 1] = u, v
        det_reciprocal = _1 / det
        conics[i, 0], conics[i, 1] = c * det_reciprocal, -b * det_reciprocal
        conics[i, 2] = a * det_reciprocal


@inlined_kernel
def to_camera(camera, means, i):
    """Return the center of a Gaussian in camera space."""
    x, y, z = multiply_vector(camera, means[i, 0], means[i, 1], means[i, 2])
    return x + camera[9], y + camera[10], z + camera[11]


@inlined_kernel
def _may_be_visible(camera, scales, i, x, y, inverse_z, u, v):
    """Return False if the Gaussian would be invisible even with its largest scale everywhere.

    This takes a fraction of the time of the covariance.
    """
    slope_x, slope_y, _, _ = clamp_slopes(camera, x, y, inverse_z)
    scale = max(scales[i, 0], scales[i, 1], scales[i, 2]) * inverse_z
    sx, sy = camera[12] * scale, camera[13] * scale
    variance_x = sx * sx * (_1 + slope_x * slope_x) + camera[22]
    variance_y = sy * sy * (_1 + slope_y * slope_y) + camera[23]
    outside_x, outside_y = max(-u, u - camera[16], _0), max(-v, v - camera[17], _0)
    return not (
        outside_x * outside_x > _MAX_SQUARED_EXTENT * variance_x
        or outside_y * outside_y > _MAX_SQUARED_EXTENT * variance_y
    )


@inlined_kernel
def _overlaps_range(center, extent, size):
    """Return whether center ± extent is finite and overlaps the interval from 0 to size."""
    return center + extent >= _0 and center - extent <= size and math.isfinite(center + extent)


@inlined_kernel
def compute_rotation_matrix(quaternions, i):
    """Return the rotation matrix of a quaternion, which is normalized first."""
    w, x, y, z = quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3]
    inverse_length = _1 / math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w * inverse_length, x * inverse_length, y * inverse_length, z * inverse_length
    return (
        _1 - _2 * (y * y + z * z), _2 * (x * y - w * z), _2 * (x * z + w * y),
        _2 * (x * y + w * z), _1 - _2 * (x * x + z * z), _2 * (y * z - w * x),
        _2 * (x * z - w * y), _2 * (y * z + w * x), _1 - _2 * (x * x + y * y),
    )  # fmt: skip


@inlined_kernel
def clamp_slopes(camera, x, y, inverse_z):
    """Return x/z and y/z, clamped for the Jacobian, and whether clamping left each unchanged."""
    slope_x, slope_y = x * inverse_z, y * inverse_z
    clamped_x = min(max(slope_x, camera[24]), camera[25])
    clamped_y = min(max(slope_y, camera[26]), camera[27])
    return clamped_x, clamped_y, clamped_x == slope_x, clamped_y == slope_y


@inlined_kernel
def project_axes(camera, rotation, scales, i, x, y, inverse_z):
    """Return the scaled axes in camera space, and the two rows of the projected axes."""
    m = multiply_matrices(camera, rotation)
    sx, sy, sz = scales[i, 0], scales[i, 1], scales[i, 2]
    m = (
        m[0] * sx, m[1] * sy, m[2] * sz,
        m[3] * sx, m[4] * sy, m[5] * sz,
        m[6] * sx, m[7] * sy, m[8] * sz,
    )  # fmt: skip
    slope_x, slope_y, _, _ = clamp_slopes(camera, x, y, inverse_z)
    jx, jy = camera[12] * inverse_z, camera[13] * inverse_z
    u = (jx * (m[0] - slope_x * m[6]), jx * (m[1] - slope_x * m[7]), jx * (m[2] - slope_x * m[8]))
    v = (jy * (m[3] - slope_y * m[6]), jy * (m[4] - slope_y * m[7]), jy * (m[5] - slope_y * m[8]))
    return m, u, v


@inlined_kernel
def _covariance(camera, rotation, scales, i, x, y, inverse_z):
    _, u, v = project_axes(camera, rotation, scales, i, x, y, inverse_z)
    return (
        u[0] * u[0] + u[1] * u[1] + u[2] * u[2] + camera[22],
        u[0] * v[0] + u[1] * v[1] + u[2] * v[2],
        v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + camera[23],
    )


@inlined_kernel
def compute_viewing_direction(camera, means, i):
    """Return the direction x, y, z from the camera to a Gaussian, and the reciprocal distance."""
    x, y, z = means[i, 0] - camera[19], means[i, 1] - camera[20], means[i, 2] - camera[21]
    inverse_distance = _1 / math.sqrt(x * x + y * y + z * z)
    return x * inverse_distance, y * inverse_distance, z * inverse_distance, inverse_distance


@inlined_kernel
def _shade(camera, means, sh, colors, i):
    for k in range(3):
        colors[i, k] = SH_C0 * sh[i, 0, k] + _HALF
    if sh.shape[1] > 1:
        x, y, z, _ = compute_viewing_direction(camera, means, i)
        for k in range(3):
            colors[i, k] += SH_C1 * (z * sh[i, 2, k] - y * sh[i, 1, k] - x * sh[i, 3, k])
    for k in range(3):
        colors[i, k] = _0 if colors[i, k] < _0 else colors[i, k]  # preserves NaN
