"""Selects Gaussians to delete, by the gain in the pictures of a frame.

A picture is linear in the opacity of one Gaussian while the others are constant, so the slope of
the loss predicts the effect of deleting it. This ignores that overlapping Gaussians cannot all be
deleted and that the loss is not linear. The number of deleted Gaussians is therefore found by
trials.
"""

from dataclasses import replace

import torch
from torch import Tensor

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.trainable import Attributes

_FEWER = 4  # factor from one trial to the next


def choose_deletions(
    context: TrainingContext, attributes: Attributes, frame: int, dssim: float
) -> Tensor:
    """Return the mask `[N]` of the Gaussians whose deletion reduces the loss most.

    Args:
        context: Views and renderer.
        attributes: Of the Gaussians.
        frame: Ordinal of the frame.
        dssim: Weight of D-SSIM in the loss.
    """
    gains = _predict_gains(context, attributes, frame, dssim)
    order = torch.argsort(gains, descending=True, stable=True)
    nobody = torch.zeros_like(gains, dtype=torch.bool)
    best, least = nobody, _measure(context, attributes, frame, dssim)
    count = min(int((gains > 0).sum()), len(gains) - 1)
    while count:
        dying = nobody.clone()
        dying[order[:count]] = True
        loss = _measure(context, attributes.rows(~dying), frame, dssim)
        if loss < least:
            best, least = dying, loss
        count //= _FEWER
    return best


def _predict_gains(
    context: TrainingContext, attributes: Attributes, frame: int, dssim: float
) -> Tensor:
    """Return `[N]` the decrease of the loss if each Gaussian alone is deleted, from the slope."""
    logits = attributes.opacities.detach().clone().requires_grad_()
    free = replace(attributes, opacities=logits)
    slopes = torch.zeros_like(attributes.opacities)
    for view in range(len(context.views.cameras)):
        image = context.render(free.activated(), view).image
        loss = photometric_loss(image, context.truth(view, frame), dssim)
        slopes += torch.autograd.grad(loss, logits)[0]
    return slopes * (1 + torch.exp(attributes.opacities))  # o dL/do, with d o = o (1 - o) d logit


def _measure(context: TrainingContext, attributes: Attributes, frame: int, dssim: float) -> float:
    """Return the sum of the losses of all training views."""
    drawn, total = attributes.activated(), 0.0
    with torch.no_grad():
        for view in range(len(context.views.cameras)):
            image = context.render(drawn, view).image
            total += float(photometric_loss(image, context.truth(view, frame), dssim))
    return total
