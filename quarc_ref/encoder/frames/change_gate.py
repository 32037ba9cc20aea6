"""The change gate, which detects where the scene changed between frames (paper section 5).

One rendered scene is compared with two pictures a frame apart; the difference of the two losses
has a screen-space gradient only where the pictures differ (Eq. 4).
"""

import torch
from torch import Tensor

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.rendering.rasterizer import to_ndc

_MIN_MEDIAN = 1e-12


def measure_change(
    context: TrainingContext, attributes: Attributes, frame: int, view_count: int
) -> Tensor:
    """Return the gate's `[N]` weights of the Gaussians, from 0 to 1 (Eq. 5).

    Args:
        context: Views and renderer.
        attributes: Attributes of the scene after its motion.
        frame: Ordinal of the frame, which is compared with the previous one.
        view_count: Number of training views to use, evenly distributed and the same in
            every frame; 0 opens the gate for all Gaussians.

    The median is computed over the Gaussians that are visible in some view. With the
    others, it could be 0, which would open the gate for all.
    """
    if view_count == 0:
        return torch.ones_like(attributes.opacities)
    total = torch.zeros_like(attributes.opacities)
    seen = torch.zeros_like(attributes.opacities, dtype=torch.bool)
    view_total = len(context.views.cameras)
    for place in range(min(view_count, view_total)):
        view = place * view_total // min(view_count, view_total)
        gaussians = attributes.detached()
        gaussians.means.requires_grad_()
        rendering = context.render(gaussians.activated(), view)
        now, before = (
            (context.mask(rendering.image, view, at) - context.truth(view, at)).abs().mean()
            for at in (frame, frame - 1)
        )
        change = now - before
        (gradient,) = torch.autograd.grad(change, rendering.means2d)
        total += to_ndc(gradient, context.camera(view)).norm(dim=1)
        seen |= rendering.radii > 0
    median = total[seen].median() if bool(seen.any()) else total.new_tensor(0.0)
    return total / (total + median.clamp(min=_MIN_MEDIAN))
