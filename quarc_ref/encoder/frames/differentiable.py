"""Differentiable operations of the motion surrogate (`surrogate`).

Float32 tensors on the CPU are processed by numba kernels, and all other tensors by torch
operations. The results of the two implementations agree to float precision.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable

from quarc_ref.encoder.frames import surrogate_kernels
from quarc_ref.encoder.training.straight_through import is_rounding, round_to_step
from quarc_ref.rendering.pipeline import KERNEL_LOCK
from quarc_ref.rendering.tensor_arrays import has_kernels, to_array

_SQUARED_NORM_FLOOR = 1e-12


def multiply_quaternions(left: Tensor, right: Tensor) -> Tensor:
    """Return the `[N, 4]` Hamilton products of quaternions wxyz."""
    if has_kernels(left):
        product: Tensor = _QuaternionProduct.apply(left, right)
        return product
    aw, ax, ay, az = left.unbind(dim=1)
    bw, bx, by, bz = right.unbind(dim=1)
    return torch.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        dim=1,
    )


def round_masked(values: Tensor, limits: Tensor, mask: Tensor) -> Tensor:
    """Round the values selected by a mask to integers, with the gradient of the identity.

    Args:
        values: `[N, k]` values.
        limits: `[k]` maximum magnitudes. Larger values are clamped and have no gradient.
        mask: `[N, k]` mask of the values to round. Others become 0 and have no gradient.
    """
    if has_kernels(values) and is_rounding():
        rounded: Tensor = _RoundMasked.apply(values, limits, mask)
        return rounded
    return round_to_step(torch.clamp(values, -limits, limits), 1.0) * mask


def mean_log_norm(values: Tensor) -> Tensor:
    """Return the mean of ln(1 + norm) over the rows of `[N, k]`."""
    if has_kernels(values):
        mean: Tensor = _MeanLogNorm.apply(values)
        return mean
    return torch.log1p(values.square().sum(dim=1).add(_SQUARED_NORM_FLOOR).sqrt()).mean()


def sum_log_magnitudes(values: Tensor, mask: Tensor) -> Tensor:
    """Return the sum of ln(1 + magnitude) over the values `[N, k]` selected by a mask `[N, k]`."""
    if has_kernels(values):
        total: Tensor = _SumLogMagnitudes.apply(values, mask)
        return total
    return (values * mask).abs().log1p().sum()


def sum_levels(residuals: Tensor, anchors: Tensor, followers: Tensor, starts: Tensor) -> Tensor:
    """Return the `[N, c]` sums of the residuals of each Gaussian's anchors, one per level.

    The gradient is summed in a fixed order, so that results are reproducible.

    Args:
        residuals: `[A, c]` residuals of the anchors.
        anchors: `[L, N]` index in `residuals` of each Gaussian's anchor at each level.
        followers: `[L * N]` indices of the Gaussians bound to each anchor, sorted by anchor.
        starts: `[A + 1]` index in `followers` of the first Gaussian of each anchor.
    """
    total: Tensor = _SumLevels.apply(residuals, anchors, followers, starts)
    return total


class _QuaternionProduct(Function):
    @staticmethod
    def forward(ctx: Any, left: Tensor, right: Tensor) -> Tensor:  # noqa: ANN401
        ctx.cache = (to_array(left), to_array(right))
        products = np.empty_like(ctx.cache[0])
        with KERNEL_LOCK:
            surrogate_kernels.multiply_quaternions(*ctx.cache, products)
        return torch.from_numpy(products)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor]:  # noqa: ANN401
        left_gradients, right_gradients = (np.empty_like(array) for array in ctx.cache)
        with KERNEL_LOCK:
            surrogate_kernels.multiply_quaternions_backward(
                *ctx.cache, to_array(gradient), left_gradients, right_gradients
            )
        return torch.from_numpy(left_gradients), torch.from_numpy(right_gradients)


class _RoundMasked(Function):
    @staticmethod
    def forward(ctx: Any, values: Tensor, limits: Tensor, mask: Tensor) -> Tensor:  # noqa: ANN401
        ctx.cache = (to_array(values), to_array(limits), mask.numpy())
        rounded = np.empty_like(ctx.cache[0])
        with KERNEL_LOCK:
            surrogate_kernels.round_masked(*ctx.cache, rounded)
        return torch.from_numpy(rounded)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:  # noqa: ANN401
        value_gradients = np.empty_like(ctx.cache[0])
        with KERNEL_LOCK:
            surrogate_kernels.round_masked_backward(*ctx.cache, to_array(gradient), value_gradients)
        return torch.from_numpy(value_gradients), None, None


class _MeanLogNorm(Function):
    @staticmethod
    def forward(ctx: Any, values: Tensor) -> Tensor:  # noqa: ANN401
        rows = to_array(values)
        logs, derivatives = (np.empty(rows.shape[0], dtype=np.float32) for _ in range(2))
        with KERNEL_LOCK:
            surrogate_kernels.log_norms(rows, np.float32(_SQUARED_NORM_FLOOR), logs, derivatives)
        ctx.save_for_backward(values, torch.from_numpy(derivatives))
        return torch.from_numpy(logs).mean()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> Tensor:  # noqa: ANN401
        values, derivatives = ctx.saved_tensors
        value_gradients: Tensor = values * (derivatives * (gradient / derivatives.numel()))[:, None]
        return value_gradients


class _SumLogMagnitudes(Function):
    @staticmethod
    def forward(ctx: Any, values: Tensor, mask: Tensor) -> Tensor:  # noqa: ANN401
        rows = to_array(values)
        logs, derivatives = np.empty(rows.shape[0], dtype=np.float32), np.empty_like(rows)
        with KERNEL_LOCK:
            surrogate_kernels.log_magnitudes(rows, mask.numpy(), logs, derivatives)
        ctx.save_for_backward(torch.from_numpy(derivatives))
        return torch.from_numpy(logs).sum()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:  # noqa: ANN401
        (derivatives,) = ctx.saved_tensors
        return derivatives * gradient, None


class _SumLevels(Function):
    @staticmethod
    def forward(
        ctx: Any,  # noqa: ANN401
        residuals: Tensor,
        anchors: Tensor,
        followers: Tensor,
        starts: Tensor,
    ) -> Tensor:
        ctx.cache = (followers, starts)
        if has_kernels(residuals):
            sums = np.empty((anchors.shape[1], residuals.shape[1]), dtype=np.float32)
            with KERNEL_LOCK:
                surrogate_kernels.sum_levels(to_array(residuals), anchors.numpy(), sums)
            return torch.from_numpy(sums)
        total = residuals.index_select(0, anchors[0])
        for level in anchors[1:]:
            total += residuals.index_select(0, level)
        return total

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None, None]:  # noqa: ANN401
        followers, starts = ctx.cache
        if has_kernels(gradient):
            anchor_gradients = np.empty((starts.numel() - 1, gradient.shape[1]), dtype=np.float32)
            with KERNEL_LOCK:
                surrogate_kernels.sum_followers(
                    to_array(gradient), followers.numpy(), starts.numpy(), anchor_gradients
                )
            return torch.from_numpy(anchor_gradients), None, None, None
        follower_gradients = gradient.index_select(0, followers)
        sums = torch.segment_reduce(follower_gradients, "sum", offsets=starts, axis=0, unsafe=True)
        return sums, None, None, None
