"""Computes exposures and reference loss from decoded frame 0, for use in all later frames.

Exposures and loss depend only on the stream and the pictures, so a resumed encode computes
the same values.
"""

from collections.abc import Iterator

import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import from_splats


def render_views(context: TrainingContext, state: FrameState) -> Iterator[tuple[Tensor, Tensor]]:
    """Yield, for each view, the rendering of the decoded scene and the picture, both `[H, W, 3]`.

    Masked pixels are black in both images.
    """
    gaussians = from_splats(dequantize(state.scene), context.device).activated()
    for view in range(len(context.views.cameras)):
        with torch.no_grad():
            image = context.render(gaussians, view).image
        image = context.apply_mask(image, view, state.scene.frame)
        yield image, context.views.picture(view, state.scene.frame)


def refit_exposures(context: TrainingContext, state: FrameState) -> None:
    """Estimate the exposures of the training views from a decoded scene."""
    context.exposures.estimate_all(render_views(context, state))


def measure_loss(context: TrainingContext, state: FrameState, lambda_dssim: float) -> float:
    """Return the mean photometric loss of a decoded scene over the training views.

    Args:
        context: Training context whose exposures are final.
        state: Decoded state of the frame.
        lambda_dssim: Weight of D-SSIM in the loss.
    """
    losses = [
        float(context.photometric_loss(image, view, state.scene.frame, lambda_dssim))
        for view, (image, _) in enumerate(render_views(context, state))
    ]
    return sum(losses) / len(losses)
