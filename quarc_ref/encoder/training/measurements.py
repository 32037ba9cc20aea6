"""Measures scenes in all training views: error, loss and exposures.

Before frame 0 is coded, its error sets the translation step in the header. The reference loss of
later frames is the loss of decoded frame 0. Exposures and reference loss are computed from decoded
frames. They depend only on the stream and the pictures, so a resumed encode computes the same
values.
"""

import math
from collections.abc import Iterator

import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes, from_splats
from quarc_ref.rendering.rasterizer import Rendering


def measure_error(
    context: TrainingContext, attributes: Attributes, *, fits_exposures: bool
) -> float:
    """Return the root-mean-square error of frame 0 over the training views, as a fraction of white.

    Masked pixels are not counted. If all pixels are masked, the error is 0.

    Args:
        context: Training views and renderer.
        attributes: Gaussians of frame 0.
        fits_exposures: Whether the exposures of the views are estimated from these Gaussians first.
    """
    if fits_exposures:
        context.exposures.estimate_all(_make_exposure_pairs(context, attributes, 0))
    squared_error = used_share = 0.0
    for view, (image, _) in enumerate(_render_attributes(context, attributes, 0)):
        mask = context.views.mask(view, 0)
        squared_error += float((image - context.truth(view, 0)).square().mean())
        used_share += 1.0 if mask is None else float(mask.mean())
    return math.sqrt(squared_error / used_share) if used_share else 0.0


def render_views(context: TrainingContext, state: FrameState) -> Iterator[tuple[Tensor, Tensor]]:
    """Yield, for each view, the rendering of the decoded scene and the picture, both `[H, W, 3]`.

    Masked pixels are black in both images.
    """
    attributes = from_splats(dequantize(state.scene), context.device)
    return _render_attributes(context, attributes, state.scene.frame)


def refit_exposures(context: TrainingContext, state: FrameState) -> None:
    """Estimate the exposures of the training views from the decoded scene of frame 0."""
    attributes = from_splats(dequantize(state.scene), context.device)
    context.exposures.estimate_all(_make_exposure_pairs(context, attributes, state.scene.frame))


def follow_exposures(context: TrainingContext, state: FrameState, frame: int) -> None:
    """Estimate the exposures of a later frame; see `Exposures.follow`.

    Args:
        context: Training context whose exposures have been estimated for frame 0.
        state: Decoded state of the previous frame.
        frame: Ordinal of the frame.
    """
    attributes = from_splats(dequantize(state.scene), context.device)
    context.exposures.follow(_make_exposure_pairs(context, attributes, frame))


def measure_loss(context: TrainingContext, state: FrameState, lambda_dssim: float) -> float:
    """Return the mean photometric loss of a decoded scene over the training views.

    Args:
        context: Training context whose exposures are final.
        state: Decoded state of the frame.
        lambda_dssim: Weight of D-SSIM in the loss.
    """
    frame, used_views = state.scene.frame, context.views.used_at(state.scene.frame)
    losses = [
        float(context.photometric_loss(image, view, frame, lambda_dssim))
        for view, (image, _) in enumerate(render_views(context, state))
        if view in used_views
    ]
    return sum(losses) / len(losses)


def _render_attributes(
    context: TrainingContext, attributes: Attributes, frame: int
) -> Iterator[tuple[Tensor, Tensor]]:
    for view, rendering in enumerate(_render(context, attributes)):
        image = context.apply_mask(rendering.image, view, frame)
        yield image, context.views.picture(view, frame)


def _make_exposure_pairs(
    context: TrainingContext, attributes: Attributes, frame: int
) -> Iterator[tuple[Tensor, Tensor]]:
    for view, rendering in enumerate(_render(context, attributes)):
        yield context.exposure_pair(rendering, view, frame)


def _render(context: TrainingContext, attributes: Attributes) -> Iterator[Rendering]:
    """Yield the rendering of each view."""
    gaussians = attributes.activated()
    for view in range(context.view_count):
        with torch.no_grad():
            rendering = context.render(gaussians, view)
        yield rendering
