"""Stage 1 of a frame: the residuals of the anchors (paper section 4).

Every forward pass draws what quantized residuals would make of the scene; a
price on the residuals keeps still what need not move.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.frames.surrogate import BindingSums, deform
from quarc_ref.encoder.frames.updates import TrainedUpdates
from quarc_ref.encoder.frames.warm_start import start_symbols
from quarc_ref.encoder.settings.frames import MotionSettings, UpdateSettings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.quantize import quantize_residuals
from quarc_ref.encoder.training.straight_through import round_to_step, translation_step
from quarc_ref.encoder.training.trainable import (
    ADAM_EPSILON,
    Attributes,
    cosine_decay,
    from_splats,
)
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import SYMBOL_LIMIT
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import Updates
from quarc_ref.rendering.rasterizer import Rendering


@dataclass(frozen=True, slots=True, eq=False)
class FittedMotion:
    """What stage 1 found.

    Attributes:
        symbols: `[c, a]` of each level, level 1 first.
        residuals: `[A, c]` what these stand for, in steps, levels one after the
            other; other than they only `without_rounding`.
        statistics: Screen gradients over the iterations, for the births; of the Gaussians
            that are left.
        updates: Of single Gaussians; None where there are none to be.
    """

    symbols: list[Int64]
    residuals: Tensor
    statistics: ScreenStatistics
    updates: Updates | None = None


def fit_motion(
    context: TrainingContext,
    before: FrameState,
    begun: FrameState,
    settings: MotionSettings,
    update_settings: UpdateSettings | None = None,
) -> FittedMotion:
    """Fit the residuals of a frame to its pictures, and updates of single Gaussians.

    Args:
        context: Views, renderer and draws.
        before: State of the frame before.
        begun: The same after `begin_frame`.
        settings: Schedule and price.
        update_settings: Of updates, in a stream that has them; None for none.
    """
    fit = _Fit(context, before, begun, settings, update_settings)
    for step in range(settings.iterations):
        fit.take(step)
        context.progress.advance("motion", step + 1, settings.iterations)
    return fit.result()


class _Fit:
    """The motion of a frame under training; see `fit_motion`."""

    def __init__(
        self,
        context: TrainingContext,
        before: FrameState,
        begun: FrameState,
        settings: MotionSettings,
        update_settings: UpdateSettings | None,
    ) -> None:
        scene = begun.scene
        self._context, self._scene, self._settings = context, scene, settings
        self._attributes = from_splats(dequantize(scene), context.device)
        self._binding_sums = BindingSums(begun.known_anchors, context.device)
        symbols = start_symbols(before, begun, settings).to(context.device)
        self._residuals = _Residuals(symbols, self._binding_sums.borders, scene.header)
        self._updates: TrainedUpdates | None = None
        self._chosen_at = -1
        if scene.header.updates and update_settings is not None and update_settings.lr:
            self._updates = TrainedUpdates(
                scene.count, scene.header, update_settings, context.device
            )
            self._chosen_at = round(update_settings.select_at * settings.iterations)
        self._statistics = ScreenStatistics(scene.count, context.device)
        self._views = context.views.shuffled(context.generator(scene.frame, "motion"))
        self._leaves = self._residuals.leaves()
        if self._updates is not None:
            self._leaves.append(self._updates.leaf)
        groups = [{"params": [leaf]} for leaf in self._leaves]
        self._adam = torch.optim.Adam(groups, eps=ADAM_EPSILON, fused=True)

    def take(self, step: int) -> None:
        """Take a step; updates are chosen before the one at which they are to be."""
        settings, updates = self._settings, self._updates
        if updates is not None and step == self._chosen_at:
            view_count = len(self._context.views.cameras)
            updates.choose(self._move().detached(), self._lose, view_count)
        left = cosine_decay(step, settings.iterations, settings.lr_end_factor)
        rates = self._residuals.rates(settings, left) + ([updates.rate(left)] if updates else [])
        for group, rate in zip(self._adam.param_groups, rates, strict=True):
            group["lr"] = rate
        view, moved = next(self._views), self._move()
        rendering, loss = self._lose(updates.added_to(moved) if updates else moved, view)
        loss = loss + self._residuals.price(settings) + (updates.price() if updates else 0.0)
        gradient = _descend(self._adam, self._leaves, loss, rendering.means2d)
        self._statistics.add(gradient, rendering, self._context.camera(view))
        place, count = (self._scene.frame, step + 1, settings.iterations), self._scene.count
        self._context.report_step("motion", place, view, count, rendering.image, loss)

    def result(self) -> FittedMotion:
        """Return what has been found."""
        residuals = self._residuals
        fitted = FittedMotion(residuals.symbols(), residuals.in_steps(), self._statistics)
        if self._updates is None:
            return fitted
        found = self._updates.updates(self._move())
        gone = torch.zeros(self._scene.count, dtype=torch.bool, device=self._context.device)
        gone[torch.from_numpy(found.gaussians[found.dies]).to(gone.device)] = True
        return replace(fitted, statistics=self._statistics.without(gone), updates=found)

    def _move(self) -> Attributes:
        sums = self._binding_sums.sum_levels(self._residuals.quantized())
        return deform(self._attributes, *_kinds(sums), self._scene.header)

    def _lose(self, attributes: Attributes, view: int) -> tuple[Rendering, Tensor]:
        rendering = self._context.render(attributes.activated(), view)
        truth = self._context.truth(view, self._scene.frame)
        return rendering, photometric_loss(rendering.image, truth, self._settings.lambda_dssim)


def _descend(
    adam: torch.optim.Adam, leaves: Sequence[Tensor], loss: Tensor, extra: Tensor
) -> Tensor:
    """Take a step down a loss, and return the gradient by one more tensor of its graph."""
    *gradients, by_extra = torch.autograd.grad(loss, [*leaves, extra])
    for leaf, gradient in zip(leaves, gradients, strict=True):
        leaf.grad = gradient
    adam.step()
    return by_extra


class _Residuals:
    """The residuals of all levels, and their quantizer.

    Args:
        symbols: `[A, c]` where they start, in steps; levels one after the other.
        borders: Where each level begins and ends.
        header: The steps.
    """

    def __init__(self, symbols: Tensor, borders: Tensor, header: StreamHeader) -> None:
        self._steps = (translation_step(header), 1 / header.rotation_unity)
        self._sizes = borders.diff().tolist()
        first, last = borders[:-1].tolist(), borders[1:].tolist()
        self._kinds = [
            [
                (kind[i:j] * step).contiguous().requires_grad_()
                for i, j in zip(first, last, strict=True)
            ]
            for kind, step in zip(_kinds(symbols), self._steps, strict=True)
        ]

    def leaves(self) -> list[Tensor]:
        """Return what is trained: of each kind, one tensor to a level."""
        return [leaf for kind in self._kinds for leaf in kind]

    def rates(self, settings: MotionSettings, left: float) -> list[float]:
        """Return the learning rate of each leaf, where a share of the rates is left."""
        translation = settings.translation_lr * self._steps[0] or settings.lr
        return [
            rate * left * settings.level_lr_factor**level
            for rate in (translation, settings.lr)
            for level in range(len(self._sizes))
        ]

    def quantized(self) -> Tensor:
        """Return `[A, c]` the residuals that the symbols stand for, straight through."""
        parts = []
        for kind, step in zip(self._kinds, self._steps, strict=True):
            limit = SYMBOL_LIMIT * step
            parts.append(round_to_step(torch.cat(kind).clamp(-limit, limit), step))
        return torch.cat(parts, dim=1)

    def price(self, settings: MotionSettings) -> Tensor:
        """Return what the residuals cost, before rounding."""
        kinds = [torch.cat(kind) for kind in self._kinds]
        if settings.rate_model == "l1":
            return settings.rd_lambda * torch.cat(kinds, dim=1).abs().mean()
        steps = [kind / step for kind, step in zip(kinds, self._steps, strict=True)]
        norms = torch.cat(steps, dim=1).square().sum(dim=1).add(_NORM_FLOOR).sqrt()
        return settings.rd_lambda * torch.log1p(norms).mean()

    def in_steps(self) -> Tensor:
        """Return `[A, c]` the residuals that the symbols stand for, in steps."""
        with torch.no_grad():
            kinds = zip(_kinds(self.quantized()), self._steps, strict=True)
            return torch.cat([kind / step for kind, step in kinds], dim=1)

    def symbols(self) -> list[Int64]:
        """Return `[c, a]` of each level."""
        with torch.no_grad():
            residuals = self.quantized()
        kinds = zip(_kinds(residuals), self._steps, strict=True)
        rows = [quantize_residuals(kind, step) for kind, step in kinds]
        borders = np.cumsum(self._sizes)[:-1]
        return np.split(np.concatenate(rows), borders, axis=1)


def _kinds(residuals: Tensor) -> tuple[Tensor, Tensor]:
    """Return the columns of translation and of rotation."""
    return residuals[:, :_TRANSLATION], residuals[:, _TRANSLATION:]


_TRANSLATION = 3
_NORM_FLOOR = 1e-12
