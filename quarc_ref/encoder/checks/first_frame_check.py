"""Checks whether frame 0 has most of its trained Gaussians, and reproduces the training views.

Training optimizes the training views, so a scene that looks bad in them looks bad in all views.
The PSNR of each view is compared with the PSNR of its coarse picture, in which squares of 1/20
of the width are replaced by their mean colors. A view whose PSNR is lower than that of its
coarse picture shows no detail. Masked and transparent pixels are not measured.
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
from quarc_ref.encoder.training.measurements import render_views

_SQUARES_ACROSS = 20
_MIN_SQUARE_SIDE = 4
_MIN_SQUARED_ERROR = 1e-10
_MAX_DETAIL_DEFICIT = 8.0  # dB
_MAX_DROPPED_SHARE = 0.01


@dataclass(frozen=True, slots=True)
class ViewQuality:
    """Quality of a training view.

    Attributes:
        name: Name of the camera.
        psnr: PSNR of the rendering after exposure correction, dB.
        coarse_psnr: PSNR of the coarse picture, dB.
    """

    name: str
    psnr: float
    coarse_psnr: float

    @property
    def detail_db(self) -> float:
        """`psnr` minus `coarse_psnr`, dB."""
        return self.psnr - self.coarse_psnr


def check_first_frame(
    context: TrainingContext, state: FrameState, trained_count: int
) -> Iterator[Finding]:
    """Yield findings about decoded frame 0: dropped Gaussians, and quality in the training views.

    Args:
        context: Training views and renderer.
        state: Decoded frame 0.
        trained_count: Number of Gaussians before those too far away were dropped.
    """
    yield from judge_dropped(trained_count, state.scene.count)
    names = [camera.name for camera in context.views.cameras]
    weights = (_mask_used_pixels(context, view, state.scene.frame) for view in range(len(names)))
    yield from judge_views(measure_views(names, render_views(context, state), weights))


def measure_views(
    names: Iterable[str], pairs: Iterable[tuple[Tensor, Tensor]], weights: Iterable[Tensor | None]
) -> list[ViewQuality]:
    """Measure the quality of training views.

    Args:
        names: Camera name of each view.
        pairs: Rendering and picture of each view, `[H, W, 3]` from 0 to 1.
        weights: `[H, W, 1]` weight of each pixel of each view: 1 for pixels that are measured, 0
            for others; None to measure all. Views in which no pixel is measured are left out.
    """
    return [
        _measure_view(name, *pair, torch.ones_like(pair[0][..., :1]) if used is None else used)
        for name, pair, used in zip(names, pairs, weights, strict=True)
        if used is None or used.any()
    ]


def judge_dropped(trained_count: int, coded_count: int) -> Iterator[Finding]:
    """Yield a finding if more Gaussians were dropped than a few outliers."""
    dropped_count = trained_count - coded_count
    if dropped_count > _MAX_DROPPED_SHARE * trained_count:
        message = (
            f"{dropped_count:,} of {trained_count:,} Gaussians of the first frame are dropped, "
            "because they are too far from the others for the position step: remove distant "
            "initial points, or increase steps.position_pixels"
        )
        yield Finding("gaussians-dropped", message)


def judge_views(views: Sequence[ViewQuality]) -> Iterator[Finding]:
    """Yield findings about views with low quality."""
    if not views:
        return
    median_detail = median(view.detail_db for view in views)
    if median_detail < 0:
        message = (
            f"the first frame reaches only {median(v.psnr for v in views):.1f} dB on its "
            f"training views, less than the {median(v.coarse_psnr for v in views):.1f} dB of the "
            f"pictures reduced to squares of 1/{_SQUARES_ACROSS} of their width: "
            "check poses and initial points, or train longer (--preset, or "
            "--set canonical.iterations=N)"
        )
        yield Finding("first-frame-coarse", message)
    low_views = [view for view in views if view.detail_db < median_detail - _MAX_DETAIL_DEFICIT]
    if low_views:
        low_view_names = tuple(view.name for view in low_views)
        descriptions = [f"{view.name} ({view.psnr:.1f} dB)" for view in low_views]
        message = (
            f"the quality of the first frame is far lower for {format_names(descriptions)} than "
            f"for the other training views (median {median(v.psnr for v in views):.1f} dB): "
            "check the poses and pictures of these cameras"
        )
        yield Finding("first-frame-misses-cameras", message, low_view_names)


def _mask_used_pixels(context: TrainingContext, view: int, frame: int) -> Tensor | None:
    """Return the weights of `measure_views`: masked and transparent pixels have none."""
    alpha = context.views.alpha(view, frame)
    return context.views.mask(view, frame) if alpha is None else (alpha > 0).to(alpha.dtype)


def _measure_view(name: str, image: Tensor, picture: Tensor, weights: Tensor) -> ViewQuality:
    image, picture = image * weights, picture * weights
    corrected_image = (image * estimate_gain(image, picture)).clamp(0, 1)
    share = weights.mean()
    return ViewQuality(
        name,
        _measure_psnr(corrected_image, picture, share),
        _measure_psnr(_average_squares(picture, weights), picture, share),
    )


def _average_squares(picture: Tensor, weights: Tensor) -> Tensor:
    """Return the coarse picture `[H, W, 3]`: each square has the mean color of its used pixels."""
    side = max(_MIN_SQUARE_SIDE, round(picture.shape[1] / _SQUARES_ACROSS))
    planes = torch.cat([picture, weights], dim=2).permute(2, 0, 1)[None]
    means = functional.avg_pool2d(planes, side, ceil_mode=True, count_include_pad=False)
    squares = means.repeat_interleave(side, 2).repeat_interleave(side, 3)
    coarse = squares[0].permute(1, 2, 0)[: picture.shape[0], : picture.shape[1]]
    used_shares = coarse[..., 3:].clamp(min=torch.finfo(coarse.dtype).tiny)
    return coarse[..., :3] / used_shares * weights


def _measure_psnr(image: Tensor, picture: Tensor, share: Tensor) -> float:
    """Return the PSNR over a share of the pixels; all others are black in both pictures."""
    mean_squared_error = (image - picture).square().mean() / share
    return float(-10 * torch.log10(mean_squared_error.clamp(min=_MIN_SQUARED_ERROR)))
