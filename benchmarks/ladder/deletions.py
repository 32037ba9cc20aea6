"""Selects Gaussians whose deletion reduces the loss of a frame's pictures.

A picture is linear in the opacity of a single Gaussian, so the slope of the loss predicts the
effect of deleting that Gaussian. This prediction is not exact, because the loss is not linear and
Gaussians overlap. Several numbers of Gaussians to delete are therefore tried.
"""

from dataclasses import replace

import torch
from torch import Tensor

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes

_COUNT_DIVISOR = 4  # each trial deletes a quarter as many Gaussians as the previous trial


def choose_deletions(
    context: TrainingContext, attributes: Attributes, frame: int, dssim_weight: float
) -> Tensor:
    """Return which Gaussians to delete: the mask `[N]` with the lowest loss among those tried.

    Args:
        context: Views and renderer.
        attributes: Attributes of the Gaussians.
        frame: Ordinal of the frame.
        dssim_weight: Weight of D-SSIM in the loss.
    """
    loss_decreases = _predict_loss_decreases(context, attributes, frame, dssim_weight)
    order = torch.argsort(loss_decreases, descending=True, stable=True)
    none_deleted = torch.zeros_like(loss_decreases, dtype=torch.bool)
    best_mask, lowest_loss = none_deleted, _measure_loss(context, attributes, frame, dssim_weight)
    count = min(int((loss_decreases > 0).sum()), len(loss_decreases) - 1)
    while count:
        deletion_mask = none_deleted.clone()
        deletion_mask[order[:count]] = True
        loss = _measure_loss(context, attributes.rows(~deletion_mask), frame, dssim_weight)
        if loss < lowest_loss:
            best_mask, lowest_loss = deletion_mask, loss
        count //= _COUNT_DIVISOR
    return best_mask


def _predict_loss_decreases(
    context: TrainingContext, attributes: Attributes, frame: int, dssim_weight: float
) -> Tensor:
    """Return for each Gaussian by how much deleting it alone should decrease the loss, `[N]`."""
    logits = attributes.opacities.detach().clone().requires_grad_()
    attributes_with_grad = replace(attributes, opacities=logits)
    slopes = torch.zeros_like(attributes.opacities)
    for view in range(len(context.views.cameras)):
        image = context.render(attributes_with_grad.activated(), view).image
        loss = context.photometric_loss(image, view, frame, dssim_weight)
        slopes += torch.autograd.grad(loss, logits)[0]
    return slopes * (1 + torch.exp(attributes.opacities))  # o dL/do, with d o = o (1 - o) d logit


def _measure_loss(
    context: TrainingContext, attributes: Attributes, frame: int, dssim_weight: float
) -> float:
    """Return the sum of the losses of all training views."""
    gaussians, total = attributes.activated(), 0.0
    with torch.no_grad():
        for view in range(len(context.views.cameras)):
            image = context.render(gaussians, view).image
            total += float(context.photometric_loss(image, view, frame, dssim_weight))
    return total
