"""The photometric loss of 3DGS: (1 - w) L1 + w (1 - SSIM).

SSIM and its gradient are computed by numba kernels for float32 tensors on the CPU, and by torch
convolutions for all other tensors. The results of the two implementations agree to float precision.
A ground truth is compared with many renderings, so its local means and variances are cached as long
as its tensor exists.
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
from quarc_ref.rendering.constants_on_device import make_constant
from quarc_ref.rendering.pipeline import KERNEL_LOCK

_C1 = 0.01**2
_C2 = 0.03**2
_WINDOW = tuple(ssim_kernels.WINDOW.tolist())
_MOMENT_CACHE = WeakTensorKeyDictionary()
_TORCH_MOMENT_CACHE = WeakTensorKeyDictionary()


def photometric_loss(image: Tensor, truth: Tensor, lambda_dssim: float) -> Tensor:
    """Return the photometric loss of a rendering as a scalar tensor.

    Args:
        image: `[H, W, 3]` rendering.
        truth: `[H, W, 3]` ground truth from 0 to 1; its values must not change later.
        lambda_dssim: Weight w of 1 - SSIM; L1 has the weight 1 - w.
    """
    return (1 - lambda_dssim) * (image - truth).abs().mean() + lambda_dssim * (
        1 - mean_ssim(image, truth)
    )


def mean_ssim(image: Tensor, truth: Tensor) -> Tensor:
    """Return the mean SSIM of two pictures `[H, W, 3]`, differentiable with respect to `image`."""
    if image.device.type == "cpu" and image.dtype == torch.float32:
        ssim: Tensor = _NumbaSsim.apply(image, truth)
        return ssim
    return _convolved_ssim(image, truth).mean()


class _NumbaSsim(Function):
    @staticmethod
    def forward(ctx: Any, image: Tensor, truth: Tensor) -> Tensor:  # noqa: ANN401
        shape = (image.shape[0], -1)
        image_rows = image.detach().contiguous().numpy().reshape(shape)
        truth_rows, moments = _cache_moments(truth)
        ssim = np.empty_like(image_rows)
        derivatives = np.empty((3, *image_rows.shape), dtype=np.float32)
        with KERNEL_LOCK:
            ssim_kernels.ssim_forward(image_rows, truth_rows, moments, ssim, derivatives)
        ctx.cache = (image_rows, truth_rows, derivatives)
        return image.new_tensor(ssim.mean(dtype=np.float64))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:  # noqa: ANN401
        image_rows, truth_rows, derivatives = ctx.cache
        image_gradient = np.empty_like(image_rows)
        with KERNEL_LOCK:
            ssim_kernels.ssim_backward(image_rows, truth_rows, derivatives, image_gradient)
        scaled_gradient = torch.from_numpy(image_gradient) * (gradient / image_gradient.size)
        return scaled_gradient.reshape(image_rows.shape[0], -1, 3), None


def _cache_moments(truth: Tensor) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return a ground truth as `[H, 3 * W]`, and its cached local moments `[2, H, 3 * W]`."""
    truth_rows = truth.detach().contiguous().numpy().reshape(truth.shape[0], -1)
    if truth not in _MOMENT_CACHE:
        moments = np.empty((2, *truth_rows.shape), dtype=np.float32)
        with KERNEL_LOCK:
            ssim_kernels.ssim_moments(truth_rows, moments)
        _MOMENT_CACHE[truth] = moments
    return truth_rows, _MOMENT_CACHE[truth]


def _convolved_ssim(image: Tensor, truth: Tensor) -> Tensor:
    """Return the `[3, H, W]` SSIM of every pixel in each color channel."""
    planes, truth_planes = image.permute(2, 0, 1), truth.detach().permute(2, 0, 1)
    blurred = _blur(torch.cat([planes, planes * planes, planes * truth_planes]))
    mean_x, mean_xx, mean_xy = blurred.chunk(3)
    if truth not in _TORCH_MOMENT_CACHE:
        _TORCH_MOMENT_CACHE[truth] = _blur_moments(truth_planes)
    mean_y, variance_y = _TORCH_MOMENT_CACHE[truth]
    variance_x, covariance = mean_xx - mean_x * mean_x, mean_xy - mean_x * mean_y
    ssim: Tensor = (
        (2 * mean_x * mean_y + _C1)
        * (2 * covariance + _C2)
        / ((mean_x * mean_x + mean_y * mean_y + _C1) * (variance_x + variance_y + _C2))
    )
    return ssim


def _blur_moments(planes: Tensor) -> tuple[Tensor, Tensor]:
    """Return the local means and variances of planes `[3, H, W]`."""
    means, mean_squares = _blur(torch.cat([planes, planes * planes])).chunk(2)
    return means, mean_squares - means * means


def _blur(planes: Tensor) -> Tensor:
    """Filter planes `[C, H, W]` with the window of SSIM, along y and then along x."""
    count, radius = planes.shape[0], ssim_kernels.RADIUS
    taps = make_constant(_WINDOW, planes.device, planes.dtype)
    column, row = taps.reshape(1, 1, -1, 1), taps.reshape(1, 1, 1, -1)
    blurred = planes[None]
    for window, padding in ((column, (radius, 0)), (row, (0, radius))):
        weights = window.expand(count, -1, -1, -1)
        blurred = torch.nn.functional.conv2d(blurred, weights, padding=padding, groups=count)
    return blurred[0]
