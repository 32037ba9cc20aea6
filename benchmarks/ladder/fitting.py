"""Fits a rung in floats without regularizers, starting from a decoded scene."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from ladder.deletions import choose_deletions
from ladder.rungs import Rung
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.encoder.frame_coder import FrameStart
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.frames.surrogate import BindingSums, deform
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.learning_rates import canonical_learning_rates
from quarc_ref.encoder.training.straight_through import (
    position_step,
    translation_step,
    without_rounding,
)
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, from_splats
from quarc_ref.format.arrays import Int64
from quarc_ref.format.records import StreamHeader

Rates = list[float]  # learning rates in the order of `Attributes`

_FIELD_ORDER = ("translation", "rotation", "log-scales", "opacity", "SH DC", "SH rest")
_TRANSLATION, _ROTATION, *_, _SH_REST = range(len(_FIELD_ORDER))
_DELETION_PROGRESS = (
    0.5  # share of the iterations; afterwards, Gaussians can compensate for the deletions
)


@dataclass(frozen=True, slots=True, eq=False)
class FitResult:
    """The result of fitting a rung.

    Attributes:
        attributes: Attributes of the remaining `K` Gaussians, in floats.
        survivors: `[K]` index of each remaining Gaussian in the start frame.
        symbols: Symbols `[c, a]` of each anchor level if the rung moves anchors; None for other
            rungs.
    """

    attributes: Attributes
    survivors: Tensor
    symbols: list[Int64] | None = None


def fit_rung(
    context: TrainingContext, frame_start: State, rung: Rung, iterations: int, config: EncoderConfig
) -> FitResult:
    """Fit a rung to the pictures of a frame.

    Args:
        context: Views, renderer and random numbers.
        frame_start: State from which fitting starts; its scene has the ordinal of the frame to fit.
        rung: The fields that can change.
        iterations: Number of iterations.
        config: Learning rates and losses.
    """
    start_attributes = from_splats(dequantize(frame_start.scene), context.device)
    all_indices = torch.arange(frame_start.scene.count, device=context.device)
    if "anchors" in rung.free:
        return _fit_anchors(context, frame_start, start_attributes, all_indices, iterations, config)
    return _fit_free_gaussians(
        context, frame_start.scene, start_attributes, all_indices, rung, iterations, config
    )


def _fit_anchors(
    context: TrainingContext,
    frame_start: State,
    start_attributes: Attributes,
    all_indices: Tensor,
    iterations: int,
    config: EncoderConfig,
) -> FitResult:
    settings = replace(config.motion, iterations=iterations, rd_lambda=0.0, momentum=0.0)
    with without_rounding():
        motion = fit_motion(context, FrameStart(frame_start, frame_start, 0), settings)
    header = frame_start.scene.header
    sums = BindingSums(frame_start.required_anchors, context.device).sum_levels(motion.residuals)
    translations, rotations = (
        sums[:, :3] * translation_step(header),
        sums[:, 3:] / header.rotation_unity,
    )
    return FitResult(
        deform(start_attributes, translations, rotations, header).detached(),
        all_indices,
        motion.symbols,
    )


def _fit_free_gaussians(
    context: TrainingContext,
    scene: Scene,
    start_attributes: Attributes,
    survivors: Tensor,
    rung: Rung,
    iterations: int,
    config: EncoderConfig,
) -> FitResult:
    frame, rates = (
        scene.frame,
        _choose_learning_rates(rung, scene.header, config, context.views.extent),
    )
    trainer = Trainer(start_attributes, tuple(rates))
    views = context.views.shuffled_indices(context.generator(frame, "ladder"), frame)
    for step in range(iterations):
        if "deaths" in rung.free and step == round(_DELETION_PROGRESS * iterations):
            deletion_mask = choose_deletions(
                context, trainer.attributes.detached(), frame, config.motion.lambda_dssim
            )
            survivors = survivors[~deletion_mask]
            trainer.replace_rows(~deletion_mask, start_attributes.rows(survivors[:0]))
        decay = cosine_decay(step, iterations, config.motion.lr_end_factor)
        trainer.set_learning_rates([rate * decay for rate in rates])
        view = next(views)
        rendering = context.render(trainer.attributes.activated(), view)
        lambda_dssim = config.motion.lambda_dssim
        loss = context.photometric_loss(rendering.image, view, frame, lambda_dssim)
        trainer.step(loss, rendering.means2d)
        context.observers.progress.advance("ladder", step + 1, iterations)
    return FitResult(trainer.attributes.detached(), survivors)


def _choose_learning_rates(
    rung: Rung, header: StreamHeader, config: EncoderConfig, extent: float
) -> Rates:
    """Return the learning rate of each attribute; 0 if the attribute cannot change.

    Translation and rotation use the learning rates of motion, summed over all anchor levels, unless
    the rung uses those of canonical training. All other attributes use the learning rates of
    canonical training.
    """
    rates = list(canonical_learning_rates(config.canonical, extent))
    if not rung.uses_canonical_rates:
        motion = config.motion
        levels = sum(motion.level_lr_factor**level for level in range(header.level_count))
        translation = motion.translation_lr * position_step(header) or motion.lr
        rates[_TRANSLATION], rates[_ROTATION] = translation * levels, motion.lr * levels
    rates[_SH_REST] *= rung.sh_rest_rate_factor
    return [rate * (name in rung.free) for name, rate in zip(_FIELD_ORDER, rates, strict=True)]
