"""Rate-distortion selection of births, which compares their loss reduction with their bytes.

A new Gaussian is kept if it lowers the loss of the training views by more than the cost
of its share of the section. The births of a frame are kept if together they lower the
loss by more than the cost of the whole section.
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
    """Cost of the bytes of births, in units of the loss.

    Attributes:
        weight: Loss per byte.
        count_bytes: Function that returns the size of births in the frame.
    """

    weight: float
    count_bytes: Callable[[Births], int]


@dataclass(frozen=True, slots=True, eq=False)
class BirthObjective:
    """The loss of the training views as a function of the new Gaussians of a frame.

    Attributes:
        context: Training views and renderer.
        background: The decoded scene after the frame's motion, which stays fixed.
        decoded: The same scene, in integers.
        lambda_dssim: Weight of D-SSIM in the loss.
    """

    context: TrainingContext
    background: FixedScene
    decoded: Scene
    lambda_dssim: float

    def activate(self, births: Attributes) -> Gaussians:
        """Quantize new Gaussians as in the stream, and activate them for rendering."""
        return births.quantized(self.decoded.header).activated()

    def render(self, births: Gaussians, view: int) -> tuple[Rendering, Tensor]:
        """Render the scene and new Gaussians in a view; return the rendering and its loss."""
        rendering = self.background.backdrop(view).render(births)
        return rendering, self._loss(rendering.image, view)

    def mean_loss(self, births: Attributes) -> float:
        """Return the mean loss of the training views with new Gaussians."""
        drawn, views = self.activate(births), range(self.context.view_count)
        with torch.no_grad():
            return sum(float(self.render(drawn, view)[1]) for view in views) / len(views)

    def mean_loss_without(self) -> float:
        """Return the mean loss of the training views without new Gaussians."""
        views = range(self.context.view_count)
        losses = (self._loss(self.background.backdrop(view).image, view) for view in views)
        return sum(map(float, losses)) / len(views)

    def _loss(self, image: Tensor, view: int) -> Tensor:
        return self.context.photometric_loss(image, view, self.decoded.frame, self.lambda_dssim)


def select_births(
    objective: BirthObjective, births: Attributes, parents: Tensor, cost: ByteCost
) -> Births | None:
    """Return the quantized new Gaussians whose gain exceeds their cost; None if there are none.

    Args:
        objective: Loss of the frame.
        births: Trained new Gaussians, at least one.
        parents: `[n]` index of each one's parent in the scene.
        cost: Cost of their bytes.
    """
    if cost.weight:
        coded = _quantize(objective, births, parents)
        bytes_each = cost.count_bytes(coded) / parents.numel()
        chosen = measure_gains(objective, births) > cost.weight * bytes_each
        births, parents = births.rows(chosen), parents[chosen]
    if not parents.numel():
        return None
    coded = _quantize(objective, births, parents)
    gain = objective.mean_loss_without() - objective.mean_loss(births)
    return coded if gain > cost.weight * cost.count_bytes(coded) else None


def measure_gains(objective: BirthObjective, births: Attributes) -> Tensor:
    """Return the `[n]` reductions of the mean loss of the training views by each new Gaussian.

    The opacity of each Gaussian is multiplied by a factor, with respect to which the loss is
    differentiated. To second order, the reduction is the negative derivative at a factor of
    0.5. (At a factor of 1, the derivative is close to 0 after training.)
    """
    drawn = objective.activate(births)
    factors = torch.full_like(births.opacities, 0.5).requires_grad_()
    halfway = replace(drawn, opacities=drawn.opacities * factors)
    views = range(objective.context.view_count)
    gains = torch.zeros_like(births.opacities)
    for view in views:
        (slope,) = torch.autograd.grad(
            objective.render(halfway, view)[1], factors, retain_graph=view < views[-1]
        )
        gains -= slope
    return gains / len(views)


def _quantize(objective: BirthObjective, births: Attributes, parents: Tensor) -> Births:
    return quantize_births(births, parents.cpu().numpy(), objective.decoded)
