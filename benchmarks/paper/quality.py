"""Measures the quality of each frame on the held-out cameras."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.decoder import Splats
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.metrics import measure_psnr
from quarc_ref.evaluation.views import View, measure_views
from quarc_ref.format.cameras import Camera

_MOVING_THRESHOLD = 16  # of 255: more than the noise of a video codec between two frames
MOVING_VARIANT = (
    "psnr_moving: like psnr, but only over pixels with a channel that differs from the previous "
    "frame by more than 16 of 255"
)


@dataclass(frozen=True, slots=True)
class Quality:
    """Quality of each frame; each value is a mean over the held-out cameras.

    Attributes:
        psnr: PSNR in dB.
        ssim: SSIM in the variant `ssim_inria`.
        psnr_moving: PSNR of moving pixels in dB; None for frame 0, and for frames in which no pixel
            moves.
        lpips: LPIPS; empty if no weights are given.
    """

    psnr: list[float] = field(default_factory=list)
    ssim: list[float] = field(default_factory=list)
    psnr_moving: list[float | None] = field(default_factory=list)
    lpips: list[float] = field(default_factory=list)


def measure_quality(
    frames: Iterable[tuple[int, Splats]],
    cameras: Sequence[Camera],
    capture: Capture,
    lpips: Lpips | None,
) -> Quality:
    """Return the quality of frames.

    Args:
        frames: Ordinal and splats of each frame.
        cameras: Cameras for rendering, in the order of the capture.
        capture: Capture with the held-out pictures.
        lpips: LPIPS network; None to skip LPIPS.
    """
    quality = Quality()
    for frame, splats in frames:
        views = measure_views(splats, frame, cameras, capture)
        quality.psnr.append(fmean(view.psnr for view in views))
        quality.ssim.append(fmean(view.ssim for view in views))
        quality.psnr_moving.append(_measure_moving_psnr(views, frame, capture))
        if lpips is not None:
            quality.lpips.append(fmean(lpips.measure(view.decoded, view.truth) for view in views))
    return quality


def fit_slope(psnr: Sequence[float]) -> float | None:
    """Fit a line to the PSNR; return its slope in dB per 100 frames, or None for one frame."""
    if len(psnr) < 2:
        return None
    return 100 * float(np.polyfit(range(len(psnr)), psnr, 1)[0])


def _measure_moving_psnr(views: Sequence[View], frame: int, capture: Capture) -> float | None:
    if frame == 0:
        return None
    view_psnr = []
    for view, index in zip(views, capture.held_out, strict=True):
        is_moving = _find_moving_pixels(
            capture.image(index, frame), capture.image(index, frame - 1)
        )
        if view.mask is not None:
            is_moving &= view.mask
        if is_moving.any():
            view_psnr.append(
                measure_psnr(view.decoded[is_moving][:, None], view.truth[is_moving][:, None])
            )
    return fmean(view_psnr) if view_psnr else None


def _find_moving_pixels(picture: Image, previous: Image) -> NDArray[np.bool_]:
    """Return the mask `[H, W]` of pixels that differ clearly from the previous picture."""
    is_moving: NDArray[np.bool_] = (
        np.abs(picture.astype(np.int16) - previous).max(axis=2) > _MOVING_THRESHOLD
    )
    return is_moving
