"""Prunes Gaussians of frame 0 that contribute little to the pictures.

With the other Gaussians fixed, a picture is linear in the opacity of one Gaussian. Removing a
Gaussian of opacity o therefore changes a pixel by o times the derivative of the pixel with
respect to o. The contribution of a Gaussian is the sum, over all pixels of a picture, of the
squared change that its removal causes. Hutchinson's estimator gives all contributions at once:
the pixels are summed with random signs, and each contribution is the expected value of a squared
derivative of the sum.

The criterion is the squared change, not the increase of the error, because fine-tuning of the
other Gaussians removes much of the increase. The error around a Gaussian is the sum of the
squared errors of the pixels in which it is visible, weighted by its share of each pixel. The
pruning threshold is a multiple of the median of this error over all visible Gaussians. Saturated
lamps and black backgrounds barely affect the median.
"""

import math
from dataclasses import replace

import torch
from torch import Tensor

from quarc_ref.encoder.training.canonical_objective import Pruning
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.probes import (
    CHANNEL_COUNT,
    sum_weighted_by_error,
    sum_with_signs,
)
from quarc_ref.encoder.training.trainable import Attributes, Trainer, to_sh_dc
from quarc_ref.rendering.rasterizer import Gaussians

_PROBE_COUNT = 2


def prune_by_contribution(
    trainer: Trainer, context: TrainingContext, pruning: Pruning, generator: torch.Generator
) -> None:
    """Prune the Gaussians that contribute least to frame 0, and all that no view sees.

    Args:
        trainer: Trainer; its Gaussians are modified in place.
        context: Training context, whose training views are rendered.
        pruning: Which Gaussians are pruned.
        generator: Random generator of the pixel signs.
    """
    contributions, errors = measure_contributions(context, trainer.attributes.detached(), generator)
    is_visible = contributions > 0
    if not bool(is_visible.any()):
        return
    visible_contributions = contributions[is_visible].sort(descending=True).values
    min_share_count = math.ceil((1 - pruning.max_share) * len(visible_contributions))
    min_count = min(max(min_share_count, pruning.min_count), len(visible_contributions))
    min_contribution = visible_contributions[min_count - 1]
    if pruning.threshold is not None:
        threshold = pruning.threshold * errors[is_visible].median()
        min_contribution = torch.minimum(min_contribution, threshold)
    keep_mask = is_visible & (contributions >= min_contribution)
    empty_selection = keep_mask.new_zeros(0, dtype=torch.long)
    trainer.replace_rows(keep_mask, trainer.attributes.detached().rows(empty_selection))


def measure_contributions(
    context: TrainingContext, attributes: Attributes, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Measure each Gaussian's contribution to the pictures, and the error around it.

    Args:
        context: Training context, whose training views are rendered.
        attributes: Attributes of the Gaussians.
        generator: Random generator of the pixel signs.

    Returns:
        `[N]` unbiased estimates of the squared change of a picture if a Gaussian is removed, and
        `[N]` squared errors of a picture, weighted by the share that a Gaussian has in each
        pixel. Both results are summed over pixels, then averaged over color channels and over
        the views that see the Gaussian.
    """
    gaussians = attributes.activated()
    contributions, errors, view_counts = (torch.zeros_like(gaussians.opacities) for _ in range(3))
    for view in context.views.used_at(0):
        opacity_factors = torch.ones_like(contributions).requires_grad_()
        color_offsets = torch.zeros_like(contributions).requires_grad_()
        rendering = context.render(
            _add_color_offsets(_scale_opacities(gaussians, opacity_factors), color_offsets), view
        )
        image = context.apply_mask(rendering.image, view, 0)
        view_counts += rendering.radii > 0
        for _ in range(_PROBE_COUNT):
            (derivative,) = torch.autograd.grad(
                sum_with_signs(image, generator), opacity_factors, retain_graph=True
            )
            contributions += derivative.square() / (_PROBE_COUNT * CHANNEL_COUNT)
        (weighted_error,) = torch.autograd.grad(
            sum_weighted_by_error(image, context.truth(view, 0)), color_offsets
        )
        errors += weighted_error
    return contributions / view_counts.clamp(min=1), errors / view_counts.clamp(min=1)


def _scale_opacities(gaussians: Gaussians, factors: Tensor) -> Gaussians:
    """Return Gaussians with opacities multiplied by factors `[N]`."""
    return replace(gaussians, opacities=gaussians.opacities * factors)


def _add_color_offsets(gaussians: Gaussians, offsets: Tensor) -> Gaussians:
    """Return Gaussians with offsets `[N]` added to their red, green and blue."""
    sh = torch.cat(
        [gaussians.sh[:, :1] + to_sh_dc(offsets + 0.5)[:, None, None], gaussians.sh[:, 1:]], dim=1
    )
    return replace(gaussians, sh=sh)
