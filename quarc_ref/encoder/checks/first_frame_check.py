"""Checks whether a decoded first frame reproduces its training views well enough.

Training uses these views, so a scene that fails for them fails everywhere. The reference
for each picture is the PSNR of the same picture averaged over squares of a twentieth of
its width: a scene with a lower PSNR has no detail.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median

import torch
from torch import Tensor
from torch.nn import functional

from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.exposure import estimate_gain
from quarc_ref.encoder.training.first_frame import render_views

_SQUARES_ACROSS = 20
_MIN_SIDE = 4
_MIN_ERROR = 1e-10
_FAR_BELOW = 8.0  # dB


@dataclass(frozen=True, slots=True)
class ViewQuality:
    """Quality of a training view.

    Attributes:
        name: Name of the camera.
        psnr: PSNR of the rendered scene with corrected exposure, dB.
        coarse: PSNR of the picture averaged over squares, dB.
    """

    name: str
    psnr: float
    coarse: float

    @property
    def detail(self) -> float:
        """Difference between the two PSNR values, dB."""
        return self.psnr - self.coarse


def check_first_frame(context: TrainingContext, state: FrameState) -> Iterator[Finding]:
    """Yield findings about a decoded first frame."""
    names = [camera.name for camera in context.views.cameras]
    return judge_views(measure_views(names, render_views(context, state)))


def measure_views(
    names: Iterable[str], pairs: Iterable[tuple[Tensor, Tensor]]
) -> list[ViewQuality]:
    """Measure the quality of views.

    Args:
        names: Camera names of the views.
        pairs: Rendered and original picture of each view, `[H, W, 3]` from 0 to 1.
    """
    return [
        ViewQuality(
            name,
            _measure_psnr((image * estimate_gain(image, picture)).clamp(0, 1), picture),
            _measure_psnr(_average_squares(picture), picture),
        )
        for name, (image, picture) in zip(names, pairs, strict=True)
    ]


def judge_views(views: Sequence[ViewQuality]) -> Iterator[Finding]:
    """Yield findings from the quality of views."""
    usual = median(view.detail for view in views)
    if usual < 0:
        message = (
            f"the first frame reaches only {median(v.psnr for v in views):.1f} dB on its "
            f"training views, less than the pictures reduced to {_SQUARES_ACROSS} squares "
            f"across ({median(v.coarse for v in views):.1f} dB): check poses and initial "
            "points, or train longer (--preset, --set canonical.iterations=N)"
        )
        yield Finding("first-frame-coarse", message)
    low = [view for view in views if view.detail < usual - _FAR_BELOW]
    if low:
        names = tuple(view.name for view in low)
        shown = [f"{view.name} ({view.psnr:.1f} dB)" for view in low]
        message = (
            f"the quality of the first frame is far lower for {format_names(shown)} than for "
            f"the other training views (median {median(v.psnr for v in views):.1f} dB): "
            "check the poses and pictures of these cameras"
        )
        yield Finding("first-frame-misses-cameras", message, names)


def _average_squares(picture: Tensor) -> Tensor:
    """Average a picture `[H, W, 3]` over squares."""
    side = max(_MIN_SIDE, round(picture.shape[1] / _SQUARES_ACROSS))
    planes = picture.permute(2, 0, 1)[None]
    means = functional.avg_pool2d(planes, side, ceil_mode=True, count_include_pad=False)
    squares = means.repeat_interleave(side, 2).repeat_interleave(side, 3)
    return squares[0].permute(1, 2, 0)[: picture.shape[0], : picture.shape[1]]


def _measure_psnr(image: Tensor, picture: Tensor) -> float:
    error = (image - picture).square().mean().clamp(min=_MIN_ERROR)
    return float(-10 * torch.log10(error))
