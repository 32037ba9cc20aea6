"""Change gate: detects where the scene changed between frames (paper section 5).

One rendering is compared with the pictures of two consecutive frames. The difference between
the two losses has a screen-space gradient only where the pictures differ (Eq. 4).
"""

import torch
from torch import Tensor

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.rendering.rasterizer import convert_gradient_to_ndc

_MIN_MEDIAN = 1e-12


def compute_gate_weights(
    context: TrainingContext, attributes: Attributes, frame: int, view_count: int
) -> Tensor:
    """Return the `[N]` weights of the change gate, from 0 (unchanged) to 1 (Eq. 5).

    Args:
        context: Views and renderer.
        attributes: Attributes of the scene after its motion.
        frame: Ordinal of the frame that is compared with the previous frame.
        view_count: Number of training views to use. The views that are used are evenly spaced in
            the list of training views, and are the same in every frame, except that a view is
            left out if its picture of one of the two frames is not used. If `view_count` is 0,
            all weights are 1.

    The median of Eq. 5 is computed over the Gaussians that are visible in at least one view. The
    median over all Gaussians could be 0, which would open the gate everywhere.
    """
    if view_count == 0:
        return torch.ones_like(attributes.opacities)
    total_gradients = torch.zeros_like(attributes.opacities)
    is_visible = torch.zeros_like(attributes.opacities, dtype=torch.bool)
    used_views = set(context.views.used_at(frame)) & set(context.views.used_at(frame - 1))
    all_view_count = context.view_count
    for index in range(min(view_count, all_view_count)):
        view = index * all_view_count // min(view_count, all_view_count)
        if view not in used_views:
            continue
        gaussians = attributes.detached()
        gaussians.means.requires_grad_()
        rendering = context.render(gaussians.activated(), view)
        loss, previous_loss = (
            (context.apply_mask(rendering.image, view, compared_frame) - truth).abs().mean()
            for compared_frame, truth in (
                (frame, context.truth(view, frame)),
                (frame - 1, context.previous_truth(view, frame)),
            )
        )
        loss_difference = loss - previous_loss
        (gradient,) = torch.autograd.grad(loss_difference, rendering.means2d)
        total_gradients += convert_gradient_to_ndc(gradient, context.camera(view)).norm(dim=1)
        is_visible |= rendering.radii > 0
    median_gradient = (
        total_gradients[is_visible].median()
        if bool(is_visible.any())
        else total_gradients.new_tensor(0.0)
    )
    return total_gradients / (total_gradients + median_gradient.clamp(min=_MIN_MEDIAN))
