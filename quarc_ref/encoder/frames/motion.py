"""Stage 1 of training a frame: fits the motion residuals of the anchors (paper section 4).

Every iteration renders the scene after moving it by quantized residuals. The loss includes the
estimated rate of the residuals, so that the residuals of static parts of the scene become 0.
"""

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
from quarc_ref.encoder.frames.warm_start import initial_residuals
from quarc_ref.encoder.settings.frames import MotionSettings, UpdateSettings
from quarc_ref.encoder.training.adam import Adam
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics
from quarc_ref.encoder.training.quantize import quantize_residuals
from quarc_ref.encoder.training.straight_through import (
    position_step,
    round_to_step,
    translation_step,
)
from quarc_ref.encoder.training.trainable import (
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
        residuals: `[A, c]` residuals in quantization steps, levels concatenated. The
            residuals equal the symbols, except within `without_rounding`.
        statistics: Accumulated screen-space gradients of the Gaussians that updates do not
            delete, for stage 2.
        updates: Updates of individual Gaussians; None if the stream has no updates.
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
    """Fit motion and updates of individual Gaussians to the pictures of a frame.

    Args:
        context: Training views, renderer and random numbers.
        start: The frame before its motion.
        settings: Schedule, learning rates and rate-distortion weight.
        update_settings: Settings of updates; None for no updates.
        rd: Factors by which the rate-distortion weights are multiplied.
    """
    fit = _MotionFit(context, start, settings, update_settings, rd)
    for step in range(settings.iterations):
        fit.take_step(step)
        context.observers.progress.advance("motion", step + 1, settings.iterations)
    return fit.result()


class _MotionFit:
    """Trains the motion and updates of a frame step by step; see `fit_motion`."""

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
        self._binding_sums = BindingSums(start.state.required_anchors, context.device)
        initial_values = initial_residuals(start.previous, start.state, settings).to(context.device)
        scale_weight = rd.scale_absolute if settings.rate_model == "l1" else rd.scale_relative
        self._rate_weight = scale_weight(settings.rd_lambda)
        self._residuals = _Residuals(initial_values, self._binding_sums.level_offsets, scene.header)
        self._updates: TrainedUpdates | None = None
        self._choice_step = -1
        if scene.header.updates and update_settings is not None and update_settings.lr:
            self._updates = TrainedUpdates(
                scene.count, scene.header, update_settings, context.device, rd
            )
            self._choice_step = max(1, round(update_settings.choose_at * settings.iterations))
        self._statistics = ScreenStatistics(scene.count, context.device)
        generator = context.generator(scene.frame, "motion")
        self._views = context.views.shuffled_indices(generator, scene.frame)
        self._leaves = self._residuals.leaves()
        if self._updates is not None:
            self._leaves.append(self._updates.leaf)
        self._adam = Adam()

    def take_step(self, step: int) -> None:
        """Take an optimizer step; first choose residuals at `UpdateSettings.choose_at`."""
        settings, updates = self._settings, self._updates
        if step == self._choice_step:
            self._choose_residuals(self._move().detached())
        decay = cosine_decay(step, settings.iterations, settings.lr_end_factor)
        learning_rates = self._residuals.learning_rates(settings, decay)
        learning_rates += [updates.learning_rate(decay)] if updates else []
        view, moved_attributes = next(self._views), self._move()
        rendering, loss = self._render(
            updates.apply_to(moved_attributes) if updates else moved_attributes, view
        )
        if self._rate_weight:
            loss = loss + self._rate_weight * self._residuals.estimate_rate(settings)
        if updates:
            loss = loss + updates.penalty()
        *gradients, gradient = torch.autograd.grad(loss, [*self._leaves, rendering.means2d])
        self._adam.step(self._leaves, gradients, learning_rates)
        self._statistics.add(gradient, rendering, self._context.camera(view))
        step_numbers = (self._scene.frame, step + 1, settings.iterations)
        image, gaussian_count = rendering.image, self._scene.count
        self._context.report_step("motion", step_numbers, view, gaussian_count, image, loss)

    def result(self) -> FittedMotion:
        """Return the trained and quantized motion and updates."""
        residuals = self._residuals
        motion = FittedMotion(residuals.symbols(), residuals.residuals_in_steps(), self._statistics)
        if self._updates is None:
            return motion
        attributes = self._move().detached()
        self._choose_residuals(attributes)
        updates = self._updates.quantized_updates(attributes)
        is_deleted = torch.zeros(self._scene.count, dtype=torch.bool, device=self._context.device)
        is_deleted[torch.from_numpy(updates.gaussians[updates.dies]).to(is_deleted.device)] = True
        return replace(motion, statistics=self._statistics.without(is_deleted), updates=updates)

    def _choose_residuals(self, moved_attributes: Attributes) -> None:
        if self._updates is not None:
            views = self._context.views.used_at(self._scene.frame)
            self._updates.choose_residuals(moved_attributes, self._render, views)

    def _move(self) -> Attributes:
        sums = self._binding_sums.sum_levels(self._residuals.quantized())
        return deform(self._attributes, *_split_components(sums), self._scene.header)

    def _render(self, attributes: Attributes, view: int) -> tuple[Rendering, Tensor]:
        rendering = self._context.render(attributes.activated(), view)
        frame, lambda_dssim = self._scene.frame, self._settings.lambda_dssim
        return rendering, self._context.photometric_loss(rendering.image, view, frame, lambda_dssim)


class _Residuals:
    """The trained residuals of all anchor levels, and their quantizer.

    Args:
        initial_values: `[A, c]` initial residuals in quantization steps, levels concatenated.
        level_offsets: Index of the first anchor of each level, then the total number of anchors.
        header: Header of the stream, which contains the quantization steps.
    """

    def __init__(self, initial_values: Tensor, level_offsets: Tensor, header: StreamHeader) -> None:
        self._step_sizes = (translation_step(header), 1 / header.rotation_unity)
        self._position_step = position_step(header)
        self._anchor_counts = level_offsets.diff().tolist()
        level_starts, level_ends = level_offsets[:-1].tolist(), level_offsets[1:].tolist()
        self._leaves_by_component = [
            [
                (component[i:j] * step).contiguous().requires_grad_()
                for i, j in zip(level_starts, level_ends, strict=True)
            ]
            for component, step in zip(
                _split_components(initial_values), self._step_sizes, strict=True
            )
        ]

    def leaves(self) -> list[Tensor]:
        """Return the trained tensors: the translations of each level, then the rotations."""
        return [leaf for component in self._leaves_by_component for leaf in component]

    def learning_rates(self, settings: MotionSettings, decay: float) -> list[float]:
        """Return the learning rate of each tensor in `leaves`, multiplied by a decay factor."""
        translation_lr = settings.translation_lr * self._position_step or settings.lr
        return [
            lr * decay * settings.level_lr_factor**level
            for lr in (translation_lr, settings.lr)
            for level in range(len(self._anchor_counts))
        ]

    def quantized(self) -> Tensor:
        """Return the `[A, c]` quantized residuals, with straight-through gradients."""
        columns = []
        for component, step in zip(self._leaves_by_component, self._step_sizes, strict=True):
            limit = SYMBOL_LIMIT * step
            columns.append(round_to_step(torch.cat(component).clamp(-limit, limit), step))
        return torch.cat(columns, dim=1)

    def estimate_rate(self, settings: MotionSettings) -> Tensor:
        """Estimate the rate of the residuals before rounding; see `MotionSettings.rate_model`."""
        components = [torch.cat(component) for component in self._leaves_by_component]
        if settings.rate_model == "l1":
            return torch.cat(components, dim=1).abs().mean()
        components_in_steps = [
            component / step for component, step in zip(components, self._step_sizes, strict=True)
        ]
        return mean_log_norm(torch.cat(components_in_steps, dim=1))

    def residuals_in_steps(self) -> Tensor:
        """Return the `[A, c]` quantized residuals in quantization steps."""
        with torch.no_grad():
            components = zip(_split_components(self.quantized()), self._step_sizes, strict=True)
            return torch.cat([component / step for component, step in components], dim=1)

    def symbols(self) -> list[Int64]:
        """Return the `[c, a]` symbols of each level, level 1 first."""
        with torch.no_grad():
            residuals = self.quantized()
        components = zip(_split_components(residuals), self._step_sizes, strict=True)
        symbols_by_component = [
            quantize_residuals(component, step) for component, step in components
        ]
        level_starts = np.cumsum(self._anchor_counts)[:-1]
        return np.split(np.concatenate(symbols_by_component), level_starts, axis=1)


def _split_components(residuals: Tensor) -> tuple[Tensor, Tensor]:
    """Split residuals `[A, c]` into translation and rotation columns."""
    return residuals[:, :_TRANSLATION_COLUMNS], residuals[:, _TRANSLATION_COLUMNS:]


_TRANSLATION_COLUMNS = 3
