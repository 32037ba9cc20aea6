"""Stage 1 of a frame: motion residuals of the anchors (paper section 4).

Every iteration renders the scene moved by quantized residuals. The loss includes the
estimated rate of the residuals, so that static parts cost nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.encoder.frame_coder import FrameStart
from quarc_ref.encoder.frames.differentiable import mean_log_norm
from quarc_ref.encoder.frames.rate_control import RateDistortion
from quarc_ref.encoder.frames.surrogate import BindingSums, deform
from quarc_ref.encoder.frames.updates import TrainedUpdates
from quarc_ref.encoder.frames.warm_start import start_symbols
from quarc_ref.encoder.settings.frames import MotionSettings, UpdateSettings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics
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
    """Result of stage 1.

    Attributes:
        symbols: `[c, a]` motion symbols of each level, level 1 first.
        residuals: `[A, c]` residuals in steps, levels concatenated. These equal the
            symbols, except within `without_rounding`.
        statistics: Accumulated screen-space gradients of the remaining Gaussians, for stage 2.
        updates: Updates of individual Gaussians; None if the stream has none.
    """

    symbols: list[Int64]
    residuals: Tensor
    statistics: ScreenStatistics
    updates: Updates | None = None


def fit_motion(
    context: TrainingContext,
    start: FrameStart,
    settings: MotionSettings,
    update_settings: UpdateSettings | None = None,
    rd: RateDistortion = RateDistortion(),  # noqa: B008, immutable
) -> FittedMotion:
    """Fit the motion of a frame, and updates of individual Gaussians, to its pictures.

    Args:
        context: Training views, renderer and random numbers.
        start: The frame, before its motion.
        settings: Schedule and rate-distortion weight.
        update_settings: Settings of updates; None for no updates.
        rd: Scale of the rate-distortion weights.
    """
    fit = _Fit(context, start, settings, update_settings, rd)
    for step in range(settings.iterations):
        fit.take_step(step)
        context.observers.progress.advance("motion", step + 1, settings.iterations)
    return fit.result()


class _Fit:
    """The motion of a frame in training; see `fit_motion`."""

    def __init__(
        self,
        context: TrainingContext,
        start: FrameStart,
        settings: MotionSettings,
        update_settings: UpdateSettings | None,
        rd: RateDistortion,
    ) -> None:
        scene = start.state.scene
        self._context, self._scene, self._settings = context, scene, settings
        self._attributes = from_splats(dequantize(scene), context.device)
        self._binding_sums = BindingSums(start.state.known_anchors, context.device)
        symbols = start_symbols(start.previous, start.state, settings).to(context.device)
        scale = rd.absolute if settings.rate_model == "l1" else rd.relative
        self._rate_weight = scale(settings.rd_lambda)
        self._residuals = _Residuals(symbols, self._binding_sums.borders, scene.header)
        self._updates: TrainedUpdates | None = None
        self._select_at = -1
        if scene.header.updates and update_settings is not None and update_settings.lr:
            self._updates = TrainedUpdates(
                scene.count, scene.header, update_settings, context.device, rd
            )
            self._select_at = round(update_settings.select_at * settings.iterations)
        self._statistics = ScreenStatistics(scene.count, context.device)
        self._views = context.views.shuffled(context.generator(scene.frame, "motion"))
        self._leaves = self._residuals.leaves()
        if self._updates is not None:
            self._leaves.append(self._updates.leaf)
        groups = [{"params": [leaf]} for leaf in self._leaves]
        self._adam = torch.optim.Adam(groups, eps=ADAM_EPSILON, fused=True)

    def take_step(self, step: int) -> None:
        """Take an optimizer step; at `UpdateSettings.select_at`, first select updates."""
        settings, updates = self._settings, self._updates
        if updates is not None and step == self._select_at:
            updates.select(self._move().detached(), self._render, self._context.view_count)
        left = cosine_decay(step, settings.iterations, settings.lr_end_factor)
        rates = self._residuals.learning_rates(settings, left)
        rates += [updates.learning_rate(left)] if updates else []
        for group, rate in zip(self._adam.param_groups, rates, strict=True):
            group["lr"] = rate
        view, moved = next(self._views), self._move()
        rendering, loss = self._render(updates.apply_to(moved) if updates else moved, view)
        loss = (
            loss
            + self._rate_weight * self._residuals.rate(settings)
            + (updates.penalty() if updates else 0.0)
        )
        gradient = _descend(self._adam, self._leaves, loss, rendering.means2d)
        self._statistics.add(gradient, rendering, self._context.camera(view))
        place, count = (self._scene.frame, step + 1, settings.iterations), self._scene.count
        self._context.report_step("motion", place, view, count, rendering.image, loss)

    def result(self) -> FittedMotion:
        """Return the current motion and updates."""
        residuals = self._residuals
        fitted = FittedMotion(residuals.symbols(), residuals.decoded_residuals(), self._statistics)
        if self._updates is None:
            return fitted
        found = self._updates.updates(self._move())
        gone = torch.zeros(self._scene.count, dtype=torch.bool, device=self._context.device)
        gone[torch.from_numpy(found.gaussians[found.dies]).to(gone.device)] = True
        return replace(fitted, statistics=self._statistics.without(gone), updates=found)

    def _move(self) -> Attributes:
        sums = self._binding_sums.sum_levels(self._residuals.quantized())
        return deform(self._attributes, *_kinds(sums), self._scene.header)

    def _render(self, attributes: Attributes, view: int) -> tuple[Rendering, Tensor]:
        rendering = self._context.render(attributes.activated(), view)
        frame, dssim = self._scene.frame, self._settings.lambda_dssim
        return rendering, self._context.photometric_loss(rendering.image, view, frame, dssim)


def _descend(
    adam: torch.optim.Adam, leaves: Sequence[Tensor], loss: Tensor, extra: Tensor
) -> Tensor:
    """Take an optimizer step; return the gradient with respect to an additional tensor."""
    *gradients, by_extra = torch.autograd.grad(loss, [*leaves, extra])
    for leaf, gradient in zip(leaves, gradients, strict=True):
        leaf.grad = gradient
    adam.step()
    return by_extra


class _Residuals:
    """The residuals of all levels, and their quantizer.

    Args:
        symbols: `[A, c]` initial residuals in steps, levels concatenated.
        borders: Index of the first anchor of each level, and the total number of anchors.
        header: Header of the stream, which has the quantization steps.
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
        """The trained tensors: the translations of each level, then the rotations."""
        return [leaf for kind in self._kinds for leaf in kind]

    def learning_rates(self, settings: MotionSettings, left: float) -> list[float]:
        """Return the learning rate of each leaf, multiplied by a decay factor."""
        translation = settings.translation_lr * self._steps[0] or settings.lr
        return [
            rate * left * settings.level_lr_factor**level
            for rate in (translation, settings.lr)
            for level in range(len(self._sizes))
        ]

    def quantized(self) -> Tensor:
        """Quantized residuals with straight-through gradients, `[A, c]`."""
        parts = []
        for kind, step in zip(self._kinds, self._steps, strict=True):
            limit = SYMBOL_LIMIT * step
            parts.append(round_to_step(torch.cat(kind).clamp(-limit, limit), step))
        return torch.cat(parts, dim=1)

    def rate(self, settings: MotionSettings) -> Tensor:
        """Estimated rate of the residuals before rounding; see `MotionSettings.rate_model`."""
        kinds = [torch.cat(kind) for kind in self._kinds]
        if settings.rate_model == "l1":
            return torch.cat(kinds, dim=1).abs().mean()
        steps = [kind / step for kind, step in zip(kinds, self._steps, strict=True)]
        return mean_log_norm(torch.cat(steps, dim=1))

    def decoded_residuals(self) -> Tensor:
        """Quantized residuals in steps, `[A, c]`."""
        with torch.no_grad():
            kinds = zip(_kinds(self.quantized()), self._steps, strict=True)
            return torch.cat([kind / step for kind, step in kinds], dim=1)

    def symbols(self) -> list[Int64]:
        """Symbols of each level, `[c, a]`."""
        with torch.no_grad():
            residuals = self.quantized()
        kinds = zip(_kinds(residuals), self._steps, strict=True)
        rows = [quantize_residuals(kind, step) for kind, step in kinds]
        borders = np.cumsum(self._sizes)[:-1]
        return np.split(np.concatenate(rows), borders, axis=1)


def _kinds(residuals: Tensor) -> tuple[Tensor, Tensor]:
    """Split residuals into translation and rotation columns."""
    return residuals[:, :_TRANSLATION], residuals[:, _TRANSLATION:]


_TRANSLATION = 3
