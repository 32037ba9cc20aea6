"""Measures pictures against the ground truth, and describes the variants of the metrics.

Only results of the same variant of a metric are comparable: five common variants of SSIM give
0.84 to 0.90 for the same pair of pictures.
"""

import math

import numpy as np
from numpy.typing import NDArray

from quarc_ref.rendering import ssim_kernels
from quarc_ref.rendering.pipeline import KERNEL_LOCK

Picture = NDArray[np.float32]
Mask = NDArray[np.bool_]

MAX_DECIBELS = 100.0  # as in libvpx and libaom, because equal pictures would make means infinite
PSNR_VARIANT = (
    "psnr: floats clamped to [0, 1], MSE over pixels and channels, at most 100 dB, dB values "
    "averaged over frames"
)
SSIM_VARIANT = (
    "ssim_inria: 11x11 Gaussian of sigma 1.5, zero padding, mean over pixels and channels"
)
MASK_VARIANT = (
    "mask: for captures with masks, only unmasked pixels are measured; masked pixels are "
    "black in both pictures, and only LPIPS and the SSIM windows of pixels near them include them; "
    "a picture whose pixels are all masked is measured without its mask; with a transparent "
    "background, pixels are measured that the truth or the rendering covers, both on black"
)


def measure_psnr(picture: Picture, truth: Picture, mask: Mask | None = None) -> float:
    """Return the PSNR of two pictures `[H, W, 3]` from 0 to 1, in dB.

    Args:
        picture: The rendering.
        truth: The ground truth.
        mask: Non-empty `[H, W]` mask of the pixels to measure; None for all pixels.

    Returns:
        The PSNR; equal pictures have the maximum PSNR, `MAX_DECIBELS`.
    """
    if mask is not None:
        picture, truth = picture[mask], truth[mask]
    mse = float(np.square(picture.astype(np.float64) - truth).mean())
    return min(-10 * math.log10(mse), MAX_DECIBELS) if mse else MAX_DECIBELS


def measure_ssim(picture: Picture, truth: Picture, mask: Mask | None = None) -> float:
    """Return the SSIM (variant `ssim_inria`) of two pictures `[H, W, 3]` from 0 to 1.

    Args:
        picture: The rendering.
        truth: The ground truth.
        mask: Non-empty `[H, W]` mask of the pixels to average over; None for all pixels.
    """
    shape = (picture.shape[0], -1)
    first = np.ascontiguousarray(picture, dtype=np.float32).reshape(shape)
    second = np.ascontiguousarray(truth, dtype=np.float32).reshape(shape)
    ssim = np.empty_like(first)
    derivatives = np.empty((3, *first.shape), dtype=np.float32)
    moments = np.empty((2, *first.shape), dtype=np.float32)
    with KERNEL_LOCK:
        ssim_kernels.ssim_moments(second, moments)
        ssim_kernels.ssim_forward(first, second, moments, ssim, derivatives)
    values = ssim if mask is None else ssim.reshape(picture.shape)[mask]
    return float(values.mean(dtype=np.float64))
