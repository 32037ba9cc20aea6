"""Prunes Gaussians of a canonical frame that contribute little to the pictures.

With the other Gaussians fixed, a picture is linear in the opacity of one Gaussian. Removing
the Gaussian therefore changes a pixel by the derivative with respect to its opacity, times
its opacity. The sum of the squared changes over a picture is estimated without a pass per
Gaussian: the derivative of a sum of pixels with random signs is computed, whose square has
this sum as its mean (Hutchinson's estimator of a diagonal).

The criterion is the squared change, not the increase of the error, because fine-tuning of
the other Gaussians removes much of that increase. The unit of the criterion is the median
over all Gaussians of the squared error of the pixels in which a Gaussian is visible. Neither
saturated lamps nor a black background around a small subject affect this unit.
"""

from dataclasses import replace

import torch
from torch import Tensor

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes, Trainer, to_sh_dc
from quarc_ref.rendering.rasterizer import Gaussians

_PROBE_COUNT = 2
_COLORS = 3


def prune_by_contribution(
    trainer: Trainer, context: TrainingContext, price: float, generator: torch.Generator
) -> None:
    """Prune the Gaussians that contribute least to frame 0, up to half of the visible ones.

    Args:
        trainer: Trainer, which is modified in place.
        context: Training context, whose training views are used.
        price: Contribution below which Gaussians are pruned, as a multiple of the median
            error around a Gaussian.
        generator: Random generator of the probes.
    """
    presence, error = measure_contributions(context, trainer.attributes.detached(), generator)
    shown = presence > 0
    if not bool(shown.any()):
        return
    least = price * error[shown].median()
    kept = shown & (presence >= torch.minimum(least, presence[shown].median()))
    nothing = kept.new_zeros(0, dtype=torch.long)
    trainer.replace_rows(kept, trainer.attributes.detached().rows(nothing))


def measure_contributions(
    context: TrainingContext, attributes: Attributes, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Measure each Gaussian's contribution to the pictures, and the error around it.

    Args:
        context: Training context, whose training views are used.
        attributes: Attributes of the Gaussians.
        generator: Random generator of the probes.

    Returns:
        `[N]` unbiased estimates of the squared change of a picture without the Gaussian,
        and `[N]` squared errors of a picture, weighted by the Gaussian's share of each
        pixel. Both are summed over pixels and averaged over colors and the views that see
        the Gaussian.
    """
    drawn = attributes.activated()
    presence, error, seen = (torch.zeros_like(drawn.opacities) for _ in range(3))
    for view in range(len(context.views.cameras)):
        gates = torch.ones_like(presence).requires_grad_()
        tints = torch.zeros_like(presence).requires_grad_()
        rendering = context.render(_add_tints(_apply_gates(drawn, gates), tints), view)
        image = context.mask(rendering.image, view, 0)
        seen += rendering.radii > 0
        for _ in range(_PROBE_COUNT):
            signs = torch.randint(0, 2, image.shape, generator=generator) * 2 - 1
            total = (image * signs.to(image)).sum()
            (change,) = torch.autograd.grad(total, gates, retain_graph=True)
            presence += change.square() / (_PROBE_COUNT * _COLORS)
        missed = (image.detach() - context.truth(view, 0)).square().mean(dim=2)
        (shown,) = torch.autograd.grad((image.mean(dim=2) * missed).sum(), tints)
        error += shown
    return presence / seen.clamp(min=1), error / seen.clamp(min=1)


def _apply_gates(drawn: Gaussians, gates: Tensor) -> Gaussians:
    """Return Gaussians with opacities multiplied by gates `[N]`."""
    return replace(drawn, opacities=drawn.opacities * gates)


def _add_tints(drawn: Gaussians, tints: Tensor) -> Gaussians:
    """Return Gaussians with tints `[N]` added to red, green and blue."""
    sh = torch.cat([drawn.sh[:, :1] + to_sh_dc(tints + 0.5)[:, None, None], drawn.sh[:, 1:]], dim=1)
    return replace(drawn, sh=sh)
