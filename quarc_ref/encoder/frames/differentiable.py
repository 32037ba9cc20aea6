"""Differentiable operations of the motion surrogate.

On the CPU and in float32 they are numba kernels; elsewhere they are torch operations. Both
agree to float precision.
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
from quarc_ref.rendering.pipeline_data import Float32

_NORM_FLOOR = 1e-12


def multiply_quaternions(left: Tensor, right: Tensor) -> Tensor:
    """Return the `[N, 4]` Hamilton products of quaternions wxyz."""
    if _has_kernels(left):
        product: Tensor = _Product.apply(left, right)
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


def round_kept(values: Tensor, limits: Tensor, kept: Tensor) -> Tensor:
    """Round rows to integers with the gradient of the identity.

    Args:
        values: `[N, k]` values.
        limits: `[k]` largest magnitudes; beyond them the gradient is 0.
        kept: `[N]` whether a row is kept; other rows are 0 and have no gradient.
    """
    if _has_kernels(values) and is_rounding():
        rounded: Tensor = _RoundKept.apply(values, limits, kept)
        return rounded
    return round_to_step(torch.clamp(values, -limits, limits), 1.0) * kept[:, None]


def mean_log_norm(values: Tensor) -> Tensor:
    """Return the mean of ln(1 + norm) over the rows of `[N, k]`."""
    if _has_kernels(values):
        mean: Tensor = _MeanLogNorm.apply(values)
        return mean
    return torch.log1p(values.square().sum(dim=1).add(_NORM_FLOOR).sqrt()).mean()


def sum_levels(residuals: Tensor, anchors: Tensor, followers: Tensor, starts: Tensor) -> Tensor:
    """Return the `[N, c]` sums of each Gaussian's residuals over the levels.

    The gradient is summed in a fixed order, so that results can be reproduced.

    Args:
        residuals: `[A, c]` residuals of the anchors.
        anchors: `[L, N]` anchor of each Gaussian at each level.
        followers: `[L N]` Gaussians that follow the anchors, by anchor.
        starts: `[A + 1]` index of the first follower of each anchor.
    """
    total: Tensor = _SumLevels.apply(residuals, anchors, followers, starts)
    return total


class _Product(Function):
    @staticmethod
    def forward(ctx: Any, left: Tensor, right: Tensor) -> Tensor:  # noqa: ANN401
        ctx.cache = (_array(left), _array(right))
        products = np.empty_like(ctx.cache[0])
        with KERNEL_LOCK:
            surrogate_kernels.multiply_quaternions(*ctx.cache, products)
        return torch.from_numpy(products)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor]:  # noqa: ANN401
        by_left, by_right = (np.empty_like(array) for array in ctx.cache)
        with KERNEL_LOCK:
            surrogate_kernels.multiply_quaternions_backward(
                *ctx.cache, _array(gradient), by_left, by_right
            )
        return torch.from_numpy(by_left), torch.from_numpy(by_right)


class _RoundKept(Function):
    @staticmethod
    def forward(ctx: Any, values: Tensor, limits: Tensor, kept: Tensor) -> Tensor:  # noqa: ANN401
        ctx.cache = (_array(values), _array(limits), kept.numpy())
        rounded = np.empty_like(ctx.cache[0])
        with KERNEL_LOCK:
            surrogate_kernels.round_kept(*ctx.cache, rounded)
        return torch.from_numpy(rounded)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:  # noqa: ANN401
        by_values = np.empty_like(ctx.cache[0])
        with KERNEL_LOCK:
            surrogate_kernels.round_kept_backward(*ctx.cache, _array(gradient), by_values)
        return torch.from_numpy(by_values), None, None


class _MeanLogNorm(Function):
    @staticmethod
    def forward(ctx: Any, values: Tensor) -> Tensor:  # noqa: ANN401
        rows = _array(values)
        logs, slopes = (np.empty(rows.shape[0], dtype=np.float32) for _ in range(2))
        with KERNEL_LOCK:
            surrogate_kernels.log_norms(rows, np.float32(_NORM_FLOOR), logs, slopes)
        ctx.save_for_backward(values, torch.from_numpy(slopes))
        return torch.from_numpy(logs).mean()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> Tensor:  # noqa: ANN401
        values, slopes = ctx.saved_tensors
        by_values: Tensor = values * (slopes * (gradient / slopes.numel()))[:, None]
        return by_values


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
        if _has_kernels(residuals):
            sums = np.empty((anchors.shape[1], residuals.shape[1]), dtype=np.float32)
            with KERNEL_LOCK:
                surrogate_kernels.sum_levels(_array(residuals), anchors.numpy(), sums)
            return torch.from_numpy(sums)
        total = residuals.index_select(0, anchors[0])
        for level in anchors[1:]:
            total += residuals.index_select(0, level)
        return total

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None, None]:  # noqa: ANN401
        followers, starts = ctx.cache
        if _has_kernels(gradient):
            by_anchor = np.empty((starts.numel() - 1, gradient.shape[1]), dtype=np.float32)
            with KERNEL_LOCK:
                surrogate_kernels.sum_followers(
                    _array(gradient), followers.numpy(), starts.numpy(), by_anchor
                )
            return torch.from_numpy(by_anchor), None, None, None
        rows = gradient.index_select(0, followers)
        sums = torch.segment_reduce(rows, "sum", offsets=starts, axis=0, unsafe=True)
        return sums, None, None, None


def _has_kernels(tensor: Tensor) -> bool:
    return tensor.device.type == "cpu" and tensor.dtype == torch.float32


def _array(tensor: Tensor) -> Float32:
    array: Float32 = tensor.detach().contiguous().numpy()
    return array
