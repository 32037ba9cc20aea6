"""Kernels that compute the gradients of the projection.

They recompute values of the forward pass, whose module describes the conventions and cameras.
"""

import math

import numba
import numpy as np

from quarc_ref.rendering.compiled import inlined_kernel, kernel, parallel_kernel
from quarc_ref.rendering.matrix_kernels import (
    multiply_matrices_transposed,
    multiply_vector_transposed,
)
from quarc_ref.rendering.projection_kernels import (
    BLOCK_SIZE,
    SH_C0,
    SH_C1,
    clamp_slopes,
    compute_rotation_matrix,
    compute_viewing_direction,
    project_axes,
    to_camera,
)

_0 = np.float32(0)
_1 = np.float32(1)
_2 = np.float32(2)
_HALF = np.float32(0.5)


@parallel_kernel
def project_backward(
    camera, means, quaternions, scales, sh, max_exponents, colors,
    g_means2d, g_conics, g_colors, g_means, g_quaternions, g_scales, g_sh,
):  # fmt: skip
    """Compute the gradients of means, quaternions, scales and SH from gradients of the outputs."""
    count = means.shape[0]
    for block in numba.prange(-(-count // BLOCK_SIZE)):
        first = block * BLOCK_SIZE
        _project_block_backward(
            first, min(first + BLOCK_SIZE, count), camera,
            means, quaternions, scales, sh, max_exponents, colors,
            g_means2d, g_conics, g_colors, g_means, g_quaternions, g_scales, g_sh,
        )  # fmt: skip


@kernel
def _project_block_backward(
    first, end, camera, means, quaternions, scales, sh, max_exponents, colors,
    g_means2d, g_conics, g_colors, g_means, g_quaternions, g_scales, g_sh,
):  # fmt: skip
    """Compute the gradients of the Gaussians from `first` to `end` - 1."""
    for i in range(first, end):
        if not max_exponents[i] > _0:
            g_means[i] = _0
            g_quaternions[i] = _0
            g_scales[i] = _0
            g_sh[i] = _0
            continue
        x, y, z = to_camera(camera, means, i)
        inverse_z = _1 / z
        mean2d_gx, mean2d_gy, mean2d_gz = _mean2d_backward(
            camera, x, y, inverse_z, g_means2d[i, 0], g_means2d[i, 1]
        )
        covariance_gx, covariance_gy, covariance_gz = _covariance_backward(
            camera, quaternions, scales, i, x, y, inverse_z, g_conics, g_quaternions, g_scales
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


@inlined_kernel
def _mean2d_backward(camera, x, y, inverse_z, gu, gv):
    gx, gy = gu * camera[12] * inverse_z, gv * camera[13] * inverse_z
    return gx, gy, -(gx * x + gy * y) * inverse_z


@inlined_kernel
def _covariance_backward(
    camera, quaternions, scales, i, x, y, inverse_z, g_conics, g_quaternions, g_scales
):
    """Store the gradients of quaternion and scale; return the gradient of the camera-space mean."""
    rotation = compute_rotation_matrix(quaternions, i)
    m, u, v = project_axes(camera, rotation, scales, i, x, y, inverse_z)
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
    slope_x, slope_y, is_unclamped_x, is_unclamped_y = clamp_slopes(camera, x, y, inverse_z)
    jx, jy = camera[12] * inverse_z, camera[13] * inverse_z
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
    # The gradient of jx, multiplied by jx; likewise for jy.
    g_jx = gu[0] * u[0] + gu[1] * u[1] + gu[2] * u[2]
    g_jy = gv[0] * v[0] + gv[1] * v[1] + gv[2] * v[2]
    gx = g_slope_x * inverse_z if is_unclamped_x else _0
    gy = g_slope_y * inverse_z if is_unclamped_y else _0
    gz = -(gx * x + gy * y + g_jx + g_jy) * inverse_z
    return gx, gy, gz


@inlined_kernel
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


@inlined_kernel
def _shade_backward(camera, means, sh, colors, g_colors, g_sh, i):
    """Store the gradient of SH; return the part of the mean's due to the direction."""
    for k in range(3):
        g_sh[i, 0, k] = SH_C0 * g_colors[i, k] if colors[i, k] > _0 else _0
    if sh.shape[1] == 1:
        return _0, _0, _0
    x, y, z, inverse_distance = compute_viewing_direction(camera, means, i)
    gx, gy, gz = _0, _0, _0
    for k in range(3):
        g = SH_C1 * g_colors[i, k] if colors[i, k] > _0 else _0
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
