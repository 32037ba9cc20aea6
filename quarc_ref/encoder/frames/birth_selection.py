"""Rate-distortion selection of births: loss reduction is compared with the cost in bytes.

A new Gaussian is selected if it lowers the loss over the training views by more than the cost of an
average Gaussian in the births section. The selected Gaussians are coded only if together they lower
the loss by more than the cost of the section.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.quantize import quantize_births
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.records import Births
from quarc_ref.rendering.rasterizer import Gaussians, Rendering


@dataclass(frozen=True, slots=True)
class ByteCost:
    """Cost of coding births, in units of the loss.

    Attributes:
        weight: Decrease in loss that is worth one byte.
        count_bytes: Function that returns the size of the births section in bytes for given births.
    """

    weight: float
    count_bytes: Callable[[Births], int]


@dataclass(frozen=True, slots=True, eq=False)
class BirthObjective:
    """The loss over the training views as a function of the new Gaussians of a frame.

    Attributes:
        context: Training views and renderer.
        fixed_scene: The decoded scene after the frame's motion; training does not change it.
        decoded_scene: The same scene as `fixed_scene`, as the decoder's integers.
        lambda_dssim: Weight of D-SSIM in the loss.
    """

    context: TrainingContext
    fixed_scene: FixedScene
    decoded_scene: Scene
    lambda_dssim: float

    def quantize_and_activate(self, new_gaussians: Attributes) -> Gaussians:
        """Return new Gaussians, quantized as in the stream and activated for rendering."""
        return new_gaussians.quantized(self.decoded_scene.header).activated()

    def render(self, births: Gaussians, view: int) -> tuple[Rendering, Tensor]:
        """Render a view of the scene with new Gaussians; return the rendering and its loss."""
        rendering = self.fixed_scene.backdrop(view).render(births)
        return rendering, self._loss(rendering.image, view)

    def mean_loss(self, births: Attributes) -> float:
        """Return the mean loss over the training views with new Gaussians."""
        gaussians, views = self.quantize_and_activate(births), self.used_views()
        with torch.no_grad():
            return sum(float(self.render(gaussians, view)[1]) for view in views) / len(views)

    def mean_loss_without_births(self) -> float:
        """Return the mean loss over the training views without new Gaussians."""
        views = self.used_views()
        losses = (self._loss(self.fixed_scene.backdrop(view).image, view) for view in views)
        return sum(map(float, losses)) / len(views)

    def used_views(self) -> tuple[int, ...]:
        """Return the views whose pictures of the frame are used."""
        return self.context.views.used_at(self.decoded_scene.frame)

    def _loss(self, image: Tensor, view: int) -> Tensor:
        return self.context.photometric_loss(
            image, view, self.decoded_scene.frame, self.lambda_dssim
        )


def select_births(
    objective: BirthObjective, births: Attributes, parents: Tensor, cost: ByteCost
) -> Births | None:
    """Return the quantized new Gaussians whose gain exceeds their cost; None if there are none.

    Args:
        objective: Loss over the training views as a function of the births.
        births: Trained new Gaussians, at least one.
        parents: `[n]` index of each new Gaussian's parent in the scene.
        cost: Cost of coding the births.
    """
    if cost.weight:
        quantized_births = _quantize(objective, births, parents)
        bytes_per_gaussian = cost.count_bytes(quantized_births) / parents.numel()
        is_selected = estimate_gains(objective, births) > cost.weight * bytes_per_gaussian
        births, parents = births.rows(is_selected), parents[is_selected]
    if not parents.numel():
        return None
    quantized_births = _quantize(objective, births, parents)
    gain = objective.mean_loss_without_births() - objective.mean_loss(births)
    return quantized_births if gain > cost.weight * cost.count_bytes(quantized_births) else None


def estimate_gains(objective: BirthObjective, births: Attributes) -> Tensor:
    """Estimate how much each new Gaussian reduces the mean training loss, `[n]`.

    The opacity of each Gaussian is multiplied by a factor, and the loss is differentiated with
    respect to the factor. Up to second order, the reduction equals the negative derivative at a
    factor of 0.5. The derivative at a factor of 1 cannot be used, because training has brought it
    close to 0.
    """
    gaussians = objective.quantize_and_activate(births)
    factors = torch.full_like(births.opacities, 0.5).requires_grad_()
    half_opacity_gaussians = replace(gaussians, opacities=gaussians.opacities * factors)
    views = objective.used_views()
    gains = torch.zeros_like(births.opacities)
    for view in views:
        (derivative,) = torch.autograd.grad(
            objective.render(half_opacity_gaussians, view)[1],
            factors,
            retain_graph=view < views[-1],
        )
        gains -= derivative
    return gains / len(views)


def _quantize(objective: BirthObjective, births: Attributes, parents: Tensor) -> Births:
    return quantize_births(births, parents.cpu().numpy(), objective.decoded_scene)
