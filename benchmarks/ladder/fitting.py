"""Fits a rung in floats without regularizers, starting from the static scene."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from ladder.dying import choose_deletions
from ladder.rungs import Rung
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.encoder.frame_coder import FrameStart
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.frames.surrogate import BindingSums, deform
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.canonical import canonical_learning_rates
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.straight_through import translation_step, without_rounding
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, from_splats
from quarc_ref.format.arrays import Int64
from quarc_ref.format.records import StreamHeader

Rates = list[float]  # in the order of `Attributes`

_ORDER = ("translation", "rotation", "log-scales", "opacity", "SH DC", "SH rest")
_TRANSLATION, _ROTATION, *_, _REST = range(len(_ORDER))
_DELETE_AT = 0.5  # of the iterations; the others have the rest to compensate for it


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Result of a rung.

    Attributes:
        attributes: `K` rows in floats.
        alive: `[K]` indices of these Gaussians at the start.
        symbols: `[c, a]` for each level if anchors moved; None otherwise.
    """

    attributes: Attributes
    alive: Tensor
    symbols: list[Int64] | None = None


def fit_rung(
    context: TrainingContext, started: State, rung: Rung, iterations: int, config: EncoderConfig
) -> Fitted:
    """Fit a rung to the pictures of a frame.

    Args:
        context: Views, renderer and random numbers.
        started: Frame start; its scene has the ordinal of the frame to fit.
        rung: What is free.
        iterations: How many.
        config: Rates and losses.
    """
    start = from_splats(dequantize(started.scene), context.device)
    everyone = torch.arange(started.scene.count, device=context.device)
    if "anchors" in rung.free:
        return _fit_anchors(context, started, start, everyone, iterations, config)
    return _fit_single(context, started.scene, start, everyone, rung, iterations, config)


def _fit_anchors(
    context: TrainingContext,
    started: State,
    start: Attributes,
    everyone: Tensor,
    iterations: int,
    config: EncoderConfig,
) -> Fitted:
    free = replace(config.motion, iterations=iterations, rd_lambda=0.0, momentum=0.0)
    with without_rounding():
        motion = fit_motion(context, FrameStart(started, started, 0), free)
    header = started.scene.header
    sums = BindingSums(started.known_anchors, context.device).sum_levels(motion.residuals)
    shifts, turns = sums[:, :3] * translation_step(header), sums[:, 3:] / header.rotation_unity
    return Fitted(deform(start, shifts, turns, header).detached(), everyone, motion.symbols)


def _fit_single(
    context: TrainingContext,
    scene: Scene,
    start: Attributes,
    alive: Tensor,
    rung: Rung,
    iterations: int,
    config: EncoderConfig,
) -> Fitted:
    frame, rates = scene.frame, _choose_rates(rung, scene.header, config, context.views.extent)
    trainer = Trainer(start, tuple(rates))
    views = context.views.shuffled(context.generator(frame, "ladder"))
    for step in range(iterations):
        if "deaths" in rung.free and step == round(_DELETE_AT * iterations):
            dying = choose_deletions(
                context, trainer.attributes.detached(), frame, config.motion.lambda_dssim
            )
            alive = alive[~dying]
            trainer.replace_rows(~dying, start.rows(alive[:0]))
        left = cosine_decay(step, iterations, config.motion.lr_end_factor)
        trainer.set_learning_rates([rate * left for rate in rates])
        view = next(views)
        rendering = context.render(trainer.attributes.activated(), view)
        truth = context.truth(view, frame)
        loss = photometric_loss(rendering.image, truth, config.motion.lambda_dssim)
        trainer.step(loss, rendering.means2d)
        context.observers.progress.advance("ladder", step + 1, iterations)
    return Fitted(trainer.attributes.detached(), alive)


def _choose_rates(rung: Rung, header: StreamHeader, config: EncoderConfig, extent: float) -> Rates:
    """Return the learning rate of each attribute, 0 if it is not free.

    A free Gaussian moves and rotates as fast as all its anchors together would move it; all else
    changes as fast as in canonical training.
    """
    rates = list(canonical_learning_rates(config.canonical, extent))
    if not rung.canonical_learning_rates:
        motion = config.motion
        levels = sum(motion.level_lr_factor**level for level in range(header.level_count))
        translation = motion.translation_lr * translation_step(header) or motion.lr
        rates[_TRANSLATION], rates[_ROTATION] = translation * levels, motion.lr * levels
    rates[_REST] *= rung.rest_factor
    return [rate * (name in rung.free) for name, rate in zip(_ORDER, rates, strict=True)]
