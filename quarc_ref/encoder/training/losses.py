"""The photometric loss of 3DGS: (1 - w) L1 + w (1 - SSIM).

On the CPU, SSIM and its gradient are numba kernels; elsewhere, and in float64, they are
torch convolutions. Both agree to float precision. A ground truth is compared with many
renderings, so the terms of SSIM that depend only on it are cached for its lifetime.
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable
from torch.utils.weak import WeakTensorKeyDictionary

from quarc_ref.rendering import ssim_kernels
from quarc_ref.rendering.pipeline import KERNEL_LOCK

_C1 = 0.01**2
_C2 = 0.03**2
_MOMENTS = WeakTensorKeyDictionary()


def photometric_loss(image: Tensor, truth: Tensor, dssim: float) -> Tensor:
    """Return the photometric loss of a rendering.

    Args:
        image: `[H, W, 3]` rendering.
        truth: `[H, W, 3]` ground truth from 0 to 1, which must not be modified later.
        dssim: Weight of 1 - SSIM; the rest is L1.
    """
    return (1 - dssim) * (image - truth).abs().mean() + dssim * (1 - mean_ssim(image, truth))


def mean_ssim(image: Tensor, truth: Tensor) -> Tensor:
    """Return the mean SSIM of pictures `[H, W, 3]`, differentiable with respect to the first."""
    if image.device.type == "cpu" and image.dtype == torch.float32:
        value: Tensor = _NumbaSsim.apply(image, truth)
        return value
    return _convolved_ssim(image, truth).mean()


class _NumbaSsim(Function):
    @staticmethod
    def forward(ctx: Any, image: Tensor, truth: Tensor) -> Tensor:  # noqa: ANN401
        shape = (image.shape[0], -1)
        first = image.detach().contiguous().numpy().reshape(shape)
        second, moments = _recall_moments(truth)
        ssim = np.empty_like(first)
        slopes = np.empty((3, *first.shape), dtype=np.float32)
        with KERNEL_LOCK:
            ssim_kernels.ssim_forward(first, second, moments, ssim, slopes)
        ctx.cache = (first, second, slopes)
        return image.new_tensor(ssim.mean(dtype=np.float64))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:  # noqa: ANN401
        first, second, slopes = ctx.cache
        by_first = np.empty_like(first)
        with KERNEL_LOCK:
            ssim_kernels.ssim_backward(first, second, slopes, by_first)
        scaled = torch.from_numpy(by_first) * (gradient / by_first.size)
        return scaled.reshape(first.shape[0], -1, 3), None


def _recall_moments(truth: Tensor) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return a truth `[H, 3 W]` and its cached moments `[2, H, 3 W]`."""
    picture = truth.detach().contiguous().numpy().reshape(truth.shape[0], -1)
    if truth not in _MOMENTS:
        moments = np.empty((2, *picture.shape), dtype=np.float32)
        with KERNEL_LOCK:
            ssim_kernels.ssim_moments(picture, moments)
        _MOMENTS[truth] = moments
    return picture, _MOMENTS[truth]


def _convolved_ssim(image: Tensor, truth: Tensor) -> Tensor:
    """Return the `[3, H, W]` SSIM of every pixel and color."""
    taps = image.new_tensor(ssim_kernels.WINDOW)
    window = (taps[:, None] * taps).expand(3, 1, taps.numel(), taps.numel())

    def blur(picture: Tensor) -> Tensor:
        planes = picture.permute(2, 0, 1)[None]
        return torch.nn.functional.conv2d(planes, window, padding=ssim_kernels.RADIUS, groups=3)[0]

    a, b = blur(image), blur(truth)
    aa, bb, ab = (
        blur(image * image) - a * a,
        blur(truth * truth) - b * b,
        blur(image * truth) - a * b,
    )
    return (2 * a * b + _C1) * (2 * ab + _C2) / ((a * a + b * b + _C1) * (aa + bb + _C2))
