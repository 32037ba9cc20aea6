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
    "psnr_moving: as psnr, over the pixels of which a channel differs by more than 16 of 255 "
    "from the frame before"
)


@dataclass(frozen=True, slots=True)
class Quality:
    """Quality of each frame, as means over the held-out cameras.

    Attributes:
        psnr: PSNR in dB.
        ssim: SSIM in the variant `ssim_inria`.
        psnr_moving: PSNR of moving pixels in dB; None for frame 0, and if no pixel moves.
        lpips: LPIPS; empty without weights.
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
        frames: (ordinal, splats) of each frame.
        cameras: Cameras for rendering, in the order of the capture.
        capture: Capture with the held-out pictures.
        lpips: Network for LPIPS; None to leave out LPIPS.
    """
    quality = Quality()
    for frame, splats in frames:
        views = measure_views(splats, frame, cameras, capture)
        quality.psnr.append(fmean(view.psnr for view in views))
        quality.ssim.append(fmean(view.ssim for view in views))
        quality.psnr_moving.append(_measure_moving(views, frame, capture))
        if lpips is not None:
            quality.lpips.append(fmean(lpips.measure(view.decoded, view.truth) for view in views))
    return quality


def fit_slope(psnr: Sequence[float]) -> float | None:
    """Return the slope of a line fitted to the PSNR, in dB per 100 frames; None for one frame."""
    if len(psnr) < 2:
        return None
    return 100 * float(np.polyfit(range(len(psnr)), psnr, 1)[0])


def _measure_moving(views: Sequence[View], frame: int, capture: Capture) -> float | None:
    if frame == 0:
        return None
    psnrs = []
    for view, index in zip(views, capture.held_out, strict=True):
        moving = _find_moving(capture.image(index, frame), capture.image(index, frame - 1))
        if moving.any():
            psnrs.append(measure_psnr(view.decoded[moving][:, None], view.truth[moving][:, None]))
    return fmean(psnrs) if psnrs else None


def _find_moving(picture: Image, previous: Image) -> NDArray[np.bool_]:
    """Return `[H, W]` whether each pixel differs from that of the previous picture."""
    moving: NDArray[np.bool_] = (
        np.abs(picture.astype(np.int16) - previous).max(axis=2) > _MOVING_THRESHOLD
    )
    return moving
