"""What newborn are worth: what they take off the loss, against the bytes that they take.

A newborn stays if the training views gain more by it than its share of the
section costs, and the newborn of a frame stay if together they gain more than
the whole section does.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.quantize import quantize_births
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.records import Births
from quarc_ref.rendering.rasterizer import Gaussians, Rendering


@dataclass(frozen=True, slots=True, eq=False)
class BirthObjective:
    """What does not change while the newborn of a frame are trained and weighed.

    Attributes:
        context: Views, renderer and draws.
        config: Of the encoder.
        state: After the motion of the frame, decoded.
        scene: Its Gaussians.
        count_bytes: Tells how many bytes births of the frame take.
    """

    context: TrainingContext
    config: EncoderConfig
    state: FrameState
    scene: FixedScene
    count_bytes: Callable[[Births], int]

    @property
    def frame(self) -> int:
        """Ordinal of the frame."""
        return self.state.scene.frame

    def activate(self, newborn: Attributes) -> Gaussians:
        """Return newborn as a stream would carry them, to be drawn."""
        return newborn.quantized(self.state.scene.header).activated()

    def compare(self, newborn: Gaussians, view: int) -> tuple[Rendering, Tensor]:
        """Return what a view sees of the scene and the newborn, and its loss."""
        rendering = self.scene.backdrop(view).render(newborn)
        return rendering, self._lose(rendering.image, view)

    def mean_loss(self, newborn: Attributes) -> float:
        """Return the mean loss of the training views."""
        drawn, views = self.activate(newborn), range(len(self.context.views.cameras))
        with torch.no_grad():
            return sum(float(self.compare(drawn, view)[1]) for view in views) / len(views)

    def mean_loss_without(self) -> float:
        """Return the mean loss of the training views when there are no newborn."""
        views = range(len(self.context.views.cameras))
        losses = (self._lose(self.scene.backdrop(view).image, view) for view in views)
        return sum(map(float, losses)) / len(views)

    def _lose(self, image: Tensor, view: int) -> Tensor:
        truth = self.context.truth(view, self.frame)
        return photometric_loss(image, truth, self.config.motion.lambda_dssim)


def select_births(objective: BirthObjective, newborn: Attributes, parents: Tensor) -> Births | None:
    """Return the newborn that are worth their bytes, or None.

    Args:
        objective: The frame's.
        newborn: Trained; at least one.
        parents: `[n]` the index of each one's parent.
    """
    price = objective.config.births.rd_lambda / objective.state.scene.count
    if price:
        births = _code(objective, newborn, parents)
        each = objective.count_bytes(births) / parents.numel()
        worthy = measure_gains(objective, newborn) > price * each
        newborn, parents = newborn.rows(worthy), parents[worthy]
    if not parents.numel():
        return None
    births = _code(objective, newborn, parents)
    gain = objective.mean_loss_without() - objective.mean_loss(newborn)
    cost = price * objective.count_bytes(births)
    return births if gain > cost else None


def measure_gains(objective: BirthObjective, newborn: Attributes) -> Tensor:
    """Return `[n]` what each newborn takes off the mean loss of the training views.

    The slope of the loss by a newborn's opacity, all of them being half there,
    is to second order what the loss falls by as they come in; the slope at the
    end of training would be next to nothing.
    """
    drawn = objective.activate(newborn)
    there = torch.full_like(newborn.opacities, 0.5).requires_grad_()
    halfway = replace(drawn, opacities=drawn.opacities * there)
    views = range(len(objective.context.views.cameras))
    gains = torch.zeros_like(newborn.opacities)
    for view in views:
        (slope,) = torch.autograd.grad(
            objective.compare(halfway, view)[1], there, retain_graph=view < views[-1]
        )
        gains -= slope
    return gains / len(views)


def _code(objective: BirthObjective, newborn: Attributes, parents: Tensor) -> Births:
    return quantize_births(newborn, parents.cpu().numpy(), objective.state.scene)
