"""What the decoded first frame settles for all later ones: exposures, and the unit of prices.

Both follow from the file and the pictures alone, so that an encode that is resumed finds
the same.
"""

from collections.abc import Iterator

import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.trainable import from_splats


def render_views(context: TrainingContext, state: FrameState) -> Iterator[tuple[Tensor, Tensor]]:
    """Yield what a decoded scene shows in each training view, and the picture, `[H, W, 3]`."""
    drawn = from_splats(dequantize(state.scene), context.device).activated()
    for view in range(len(context.views.cameras)):
        with torch.no_grad():
            image = context.render(drawn, view).image
        yield image, context.views.picture(view, state.scene.frame)


def refit_exposures(context: TrainingContext, state: FrameState) -> None:
    """Find the exposures of the training views anew, and keep them from here on."""
    context.exposures.settle(render_views(context, state))


def measure_loss(context: TrainingContext, state: FrameState, dssim: float) -> float:
    """Return the mean loss of the training views.

    Args:
        context: Its exposures are settled.
        state: Decoded.
        dssim: Weight of D-SSIM in the loss.
    """
    losses = [
        float(photometric_loss(image, context.truth(view, state.scene.frame), dssim))
        for view, (image, _) in enumerate(render_views(context, state))
    ]
    return sum(losses) / len(losses)
