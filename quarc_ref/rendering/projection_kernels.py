"""Kernels that project Gaussians, forward and backward (EWA, SH degree 1).

Each Gaussian is processed by one thread and shares no data with others, so the number of threads
does not affect the result. The backward pass recomputes values of the forward pass. SPEC 10.3
defines the conventions: pixel centers are at +0.5, and a low-pass filter is added to the diagonal
of covariances. For the Jacobian, but not elsewhere, x/z and y/z are clamped to the picture plus a
margin.

A camera is an array of 24 numbers: rotation (9), translation (3), fx, fy, cx, cy, width, height,
nearest depth, center (3), low-pass filter in x and y (variances in pixels).
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import kernel, parallel_kernel
from quarc_ref.rendering.matrix_kernels import (
    multiply_matrices,
    multiply_matrices_transposed,
    multiply_vector,
    multiply_vector_transposed,
)

MIN_ALPHA = np.float32(1 / 255)
SLOPE_MARGIN_FRACTION = np.float32(0.15)  # relative to the picture size
# Copies of SPEC 3.1: kernels import no constants, because numba would not compile them again
# after a change.
SH_C0 = np.float32(0.28209479177387814)
SH_C1 = np.float32(0.4886025119029199)
_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_3 = np.float32(3)
_HALF = np.float32(0.5)


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
    for i in numba.prange(means.shape[0]):
        max_exponents[i] = _0
        x, y, z = _to_camera(camera, means, i)
        if not (camera[18] < z < np.inf and opacities[i] > MIN_ALPHA):
            continue
        rotation = _rotation_matrix(quaternions, i)
        a, b, c = _covariance(camera, rotation, scales, i, x, y, z)
        det = a * c - b * b
        if not _0 < det < np.inf:
            continue
        max_exponent = math.log(opacities[i] / MIN_ALPHA)
        u, v = camera[12] * x / z + camera[14], camera[13] * y / z + camera[15]
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
        conics[i, 0], conics[i, 1], conics[i, 2] = c / det, -b / det, a / det


@parallel_kernel
def project_backward(
    camera, means, quaternions, scales, sh, max_exponents, colors,
    g_means2d, g_conics, g_colors, g_means, g_quaternions, g_scales, g_sh,
):  # fmt: skip
    """Compute the gradients of means, quaternions, scales and SH from gradients of the outputs."""
    for i in numba.prange(means.shape[0]):
        if not max_exponents[i] > _0:
            g_means[i] = _0
            g_quaternions[i] = _0
            g_scales[i] = _0
            g_sh[i] = _0
            continue
        x, y, z = _to_camera(camera, means, i)
        mean2d_gx, mean2d_gy, mean2d_gz = _mean2d_backward(
            camera, x, y, z, g_means2d[i, 0], g_means2d[i, 1]
        )
        covariance_gx, covariance_gy, covariance_gz = _covariance_backward(
            camera, quaternions, scales, i, x, y, z, g_conics, g_quaternions, g_scales
        )
        world_gx, world_gy, world_gz = multiply_vector_transposed(
            camera, mean2d_gx + covariance_gx, mean2d_gy + covariance_gy, mean2d_gz + covariance_gz
        )
        shading_gx, shading_gy, shading_gz = _shade_backward(
            camera, means, sh, colors, g_colors, g_sh, i
        )
        g_means[i, 0], g_means[i, 1], g_means[i, 2] = (
            world_gx + shading_gx,
            world_gy + shading_gy,
            world_gz + shading_gz,
        )


@kernel
def _to_camera(camera, means, i):
    x, y, z = multiply_vector(camera, means[i, 0], means[i, 1], means[i, 2])
    return x + camera[9], y + camera[10], z + camera[11]


@kernel
def _overlaps_range(center, extent, size):
    """Return whether center ± extent is finite and overlaps the interval from 0 to size."""
    return center + extent >= _0 and center - extent <= size and math.isfinite(center + extent)


@kernel
def _rotation_matrix(quaternions, i):
    """Return the rotation matrix of a quaternion, which is normalized first."""
    w, x, y, z = quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3]
    inverse_length = _1 / math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w * inverse_length, x * inverse_length, y * inverse_length, z * inverse_length
    return (
        _1 - _2 * (y * y + z * z), _2 * (x * y - w * z), _2 * (x * z + w * y),
        _2 * (x * y + w * z), _1 - _2 * (x * x + z * z), _2 * (y * z - w * x),
        _2 * (x * z - w * y), _2 * (y * z + w * x), _1 - _2 * (x * x + y * y),
    )  # fmt: skip


@kernel
def _clamp_slopes(camera, x, y, z):
    """Return x/z and y/z, clamped for the Jacobian, and whether clamping left each unchanged."""
    low = -(camera[14] + SLOPE_MARGIN_FRACTION * camera[16]) / camera[12]
    high = (camera[16] - camera[14] + SLOPE_MARGIN_FRACTION * camera[16]) / camera[12]
    slope_x = min(max(x / z, low), high)
    low = -(camera[15] + SLOPE_MARGIN_FRACTION * camera[17]) / camera[13]
    high = (camera[17] - camera[15] + SLOPE_MARGIN_FRACTION * camera[17]) / camera[13]
    slope_y = min(max(y / z, low), high)
    return slope_x, slope_y, slope_x == x / z, slope_y == y / z


@kernel
def _project_axes(camera, rotation, scales, i, x, y, z):
    """Return the scaled axes in camera space, and the two rows of the projected axes."""
    m = multiply_matrices(camera, rotation)
    sx, sy, sz = scales[i, 0], scales[i, 1], scales[i, 2]
    m = (
        m[0] * sx, m[1] * sy, m[2] * sz,
        m[3] * sx, m[4] * sy, m[5] * sz,
        m[6] * sx, m[7] * sy, m[8] * sz,
    )  # fmt: skip
    slope_x, slope_y, _, _ = _clamp_slopes(camera, x, y, z)
    jx, jy = camera[12] / z, camera[13] / z
    u = (jx * (m[0] - slope_x * m[6]), jx * (m[1] - slope_x * m[7]), jx * (m[2] - slope_x * m[8]))
    v = (jy * (m[3] - slope_y * m[6]), jy * (m[4] - slope_y * m[7]), jy * (m[5] - slope_y * m[8]))
    return m, u, v


@kernel
def _covariance(camera, rotation, scales, i, x, y, z):
    _, u, v = _project_axes(camera, rotation, scales, i, x, y, z)
    return (
        u[0] * u[0] + u[1] * u[1] + u[2] * u[2] + camera[22],
        u[0] * v[0] + u[1] * v[1] + u[2] * v[2],
        v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + camera[23],
    )


@kernel
def _mean2d_backward(camera, x, y, z, gu, gv):
    gx, gy = gu * camera[12] / z, gv * camera[13] / z
    return gx, gy, -(gx * x + gy * y) / z


@kernel
def _covariance_backward(
    camera, quaternions, scales, i, x, y, z, g_conics, g_quaternions, g_scales
):
    """Store the gradients of quaternion and scale; return the gradient of the camera-space mean."""
    rotation = _rotation_matrix(quaternions, i)
    m, u, v = _project_axes(camera, rotation, scales, i, x, y, z)
    a = u[0] * u[0] + u[1] * u[1] + u[2] * u[2] + camera[22]
    b = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    c = v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + camera[23]
    inverse_det = _1 / (a * c - b * b)
    ca, cb, cc = c * inverse_det, -b * inverse_det, a * inverse_det
    ga, gb, gc = g_conics[i, 0], g_conics[i, 1], g_conics[i, 2]
    # The covariance is the inverse of the conic, so its gradient is -conic G conic, where G is the
    # gradient of the conic: a symmetric matrix with gb / 2 off the diagonal.
    pa, pb = ga * ca + _HALF * gb * cb, ga * cb + _HALF * gb * cc
    qa, qb = _HALF * gb * ca + gc * cb, _HALF * gb * cb + gc * cc
    ha, hb, hc = -(ca * pa + cb * qa), -(ca * pb + cb * qb), -(cb * pb + cc * qb)
    gu = (
        _2 * (ha * u[0] + hb * v[0]), _2 * (ha * u[1] + hb * v[1]), _2 * (ha * u[2] + hb * v[2]),
    )  # fmt: skip
    gv = (
        _2 * (hb * u[0] + hc * v[0]), _2 * (hb * u[1] + hc * v[1]), _2 * (hb * u[2] + hc * v[2]),
    )  # fmt: skip
    slope_x, slope_y, is_unclamped_x, is_unclamped_y = _clamp_slopes(camera, x, y, z)
    jx, jy = camera[12] / z, camera[13] / z
    g_m = (
        jx * gu[0], jx * gu[1], jx * gu[2],
        jy * gv[0], jy * gv[1], jy * gv[2],
        -jx * slope_x * gu[0] - jy * slope_y * gv[0],
        -jx * slope_x * gu[1] - jy * slope_y * gv[1],
        -jx * slope_x * gu[2] - jy * slope_y * gv[2],
    )  # fmt: skip
    _project_axes_backward(camera, rotation, quaternions, scales, i, g_m, g_quaternions, g_scales)
    g_slope_x = -jx * (gu[0] * m[6] + gu[1] * m[7] + gu[2] * m[8])
    g_slope_y = -jy * (gv[0] * m[6] + gv[1] * m[7] + gv[2] * m[8])
    g_jx = (gu[0] * u[0] + gu[1] * u[1] + gu[2] * u[2]) / jx
    g_jy = (gv[0] * v[0] + gv[1] * v[1] + gv[2] * v[2]) / jy
    gx = g_slope_x / z if is_unclamped_x else _0
    gy = g_slope_y / z if is_unclamped_y else _0
    gz = -(gx * x + gy * y + g_jx * jx + g_jy * jy) / z
    return gx, gy, gz


@kernel
def _project_axes_backward(camera, rotation, quaternions, scales, i, g_m, g_quaternions, g_scales):
    world_gradient = multiply_matrices_transposed(camera, g_m)
    for k in range(3):
        g_scales[i, k] = (
            world_gradient[k] * rotation[k]
            + world_gradient[3 + k] * rotation[3 + k]
            + world_gradient[6 + k] * rotation[6 + k]
        )
    sx, sy, sz = scales[i, 0], scales[i, 1], scales[i, 2]
    g = (
        world_gradient[0] * sx, world_gradient[1] * sy, world_gradient[2] * sz,
        world_gradient[3] * sx, world_gradient[4] * sy, world_gradient[5] * sz,
        world_gradient[6] * sx, world_gradient[7] * sy, world_gradient[8] * sz,
    )  # fmt: skip
    w, x, y, z = quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3]
    inverse_length = _1 / math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w * inverse_length, x * inverse_length, y * inverse_length, z * inverse_length
    gw = _2 * (x * (g[7] - g[5]) + y * (g[2] - g[6]) + z * (g[3] - g[1]))
    gx = _2 * (y * (g[1] + g[3]) + z * (g[2] + g[6]) + w * (g[7] - g[5]) - _2 * x * (g[4] + g[8]))
    gy = _2 * (x * (g[1] + g[3]) + z * (g[5] + g[7]) + w * (g[2] - g[6]) - _2 * y * (g[0] + g[8]))
    gz = _2 * (x * (g[2] + g[6]) + y * (g[5] + g[7]) + w * (g[3] - g[1]) - _2 * z * (g[0] + g[4]))
    radial = gw * w + gx * x + gy * y + gz * z
    g_quaternions[i, 0] = (gw - radial * w) * inverse_length
    g_quaternions[i, 1] = (gx - radial * x) * inverse_length
    g_quaternions[i, 2] = (gy - radial * y) * inverse_length
    g_quaternions[i, 3] = (gz - radial * z) * inverse_length


@kernel
def _viewing_direction(camera, means, i):
    x, y, z = means[i, 0] - camera[19], means[i, 1] - camera[20], means[i, 2] - camera[21]
    inverse_distance = _1 / math.sqrt(x * x + y * y + z * z)
    return x * inverse_distance, y * inverse_distance, z * inverse_distance, inverse_distance


@kernel
def _shade(camera, means, sh, colors, i):
    x, y, z, _ = _viewing_direction(camera, means, i)
    for k in range(3):
        degree_1_sum = z * sh[i, 2, k] - y * sh[i, 1, k] - x * sh[i, 3, k]
        color = SH_C0 * sh[i, 0, k] + SH_C1 * degree_1_sum + _HALF
        colors[i, k] = _0 if color < _0 else color  # preserves NaN


@kernel
def _shade_backward(camera, means, sh, colors, g_colors, g_sh, i):
    """Store the gradient of SH; return the part of the mean's due to the direction."""
    x, y, z, inverse_distance = _viewing_direction(camera, means, i)
    gx, gy, gz = _0, _0, _0
    for k in range(3):
        g = g_colors[i, k] if colors[i, k] > _0 else _0
        g_sh[i, 0, k] = SH_C0 * g
        g = SH_C1 * g
        g_sh[i, 1, k], g_sh[i, 2, k], g_sh[i, 3, k] = -y * g, z * g, -x * g
        gx -= g * sh[i, 3, k]
        gy -= g * sh[i, 1, k]
        gz += g * sh[i, 2, k]
    radial = gx * x + gy * y + gz * z
    return (
        (gx - radial * x) * inverse_distance,
        (gy - radial * y) * inverse_distance,
        (gz - radial * z) * inverse_distance,
    )
