"""Stage 2 of training a frame: adds Gaussians where the scene changes (paper section 5).

Only the new Gaussians are trained. The existing Gaussians stay fixed at their decoded state
after the motion.
"""

import numpy as np
import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.frames.birth_selection import BirthObjective, ByteCost, select_births
from quarc_ref.encoder.frames.placement import place_at_errors, place_clones
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, split
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.learning_rates import canonical_learning_rates
from quarc_ref.encoder.training.quantize import find_representable_births, quantize_births
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, from_splats
from quarc_ref.format.records import OPACITY, Births


def fit_births(
    context: TrainingContext,
    moved_state: FrameState,
    statistics: ScreenStatistics,
    config: EncoderConfig,
    cost: ByteCost,
) -> Births | None:
    """Place, train and select the new Gaussians of a frame.

    Args:
        context: Training views, renderer and random numbers.
        moved_state: The decoder's state after the motion of the frame.
        statistics: Screen-space gradients from stage 1.
        config: All settings. This function uses all birth settings, the D-SSIM weight of the motion
            settings, and the learning rates of the canonical settings.
        cost: Cost of coding the births.

    Returns:
        The quantized births; None if the frame has no births.
    """
    settings, frame = config.births, moved_state.scene.frame
    if not (settings.iterations and settings.max_births):
        return None
    fixed_scene = FixedScene(context, from_splats(dequantize(moved_state.scene), context.device))
    if settings.placement == "gate":
        births, parents = place_clones(context, fixed_scene.attributes, frame, statistics, settings)
    else:
        births, parents = place_at_errors(context, fixed_scene, frame, settings)
    if parents.numel() == 0:
        return None
    objective = BirthObjective(context, fixed_scene, moved_state.scene, config.motion.lambda_dssim)
    learning_rates = canonical_learning_rates(config.canonical, context.views.extent)
    births, parents = _train(objective, births, parents, settings, learning_rates)
    keep_mask = torch.sigmoid(births.opacities) >= settings.prune_opacity
    keep_mask &= find_representable_births(births, parents, moved_state.scene)
    births, parents = births.rows(keep_mask), parents[keep_mask]
    if parents.numel() == 0:
        return None
    if settings.rd_selection:
        return select_births(objective, births, parents, cost)
    return quantize_births(births, parents.cpu().numpy(), moved_state.scene)


def _train(
    objective: BirthObjective,
    births: Attributes,
    parents: Tensor,
    settings: BirthSettings,
    learning_rates: tuple[float, ...],
) -> tuple[Attributes, Tensor]:
    """Train new Gaussians; return the trained Gaussians and the indices of their parents."""
    context = objective.context
    trainer = Trainer(births, learning_rates)
    generator = context.generator(objective.decoded_scene.frame, "births training")
    views = context.views.shuffled_indices(generator, objective.decoded_scene.frame)
    statistics = ScreenStatistics(trainer.count, context.device)
    for step in range(settings.iterations):
        if step in settings.split_iters:
            keep_mask, split_mask = _make_keep_and_split_masks(
                trainer, statistics, settings, context.views.extent
            )
            split_gaussians = trainer.attributes.detached().rows(split_mask)
            trainer.replace_rows(keep_mask, split(split_gaussians, generator))
            parents = torch.cat([parents[keep_mask], parents[split_mask].repeat(2)])
            statistics = ScreenStatistics(trainer.count, context.device)
        if trainer.count == 0:
            break
        decay = cosine_decay(step, settings.iterations, settings.lr_end_factor)
        trainer.set_learning_rates(settings.lr_factor * decay * lr for lr in learning_rates)
        view = next(views)
        rendering, loss = objective.render(
            objective.quantize_and_activate(trainer.attributes), view
        )
        gradient = trainer.step(loss, rendering.means2d)
        statistics.add_for_last_gaussians(gradient, rendering, context.camera(view))
        step_numbers = (objective.decoded_scene.frame, step + 1, settings.iterations)
        gaussian_count = objective.decoded_scene.count + trainer.count
        context.report_step("births", step_numbers, view, gaussian_count, rendering.image, loss)
        context.observers.progress.advance("births", step + 1, settings.iterations)
    return trainer.attributes.detached(), parents


def _make_keep_and_split_masks(
    trainer: Trainer, statistics: ScreenStatistics, settings: BirthSettings, extent: float
) -> tuple[Tensor, Tensor]:
    """Return masks of the new Gaussians to keep and to split; the others are pruned."""
    births = trainer.attributes.detached()
    scales = torch.exp(births.log_scales.amax(dim=1))
    split_mask = statistics.mean_gradients() >= settings.grad_threshold
    split_mask &= scales > settings.max_parent_scale * extent
    split_mask &= split_mask.cumsum(0) <= settings.max_births - trainer.count
    keep_mask = torch.sigmoid(births.opacities) >= settings.prune_opacity
    keep_mask &= statistics.largest_radii() <= settings.prune_radius
    keep_mask &= scales <= settings.prune_scale * extent
    return keep_mask & ~split_mask, split_mask


def count_deaths(state: FrameState, target_count: int, settings: BirthSettings) -> int:
    """Return how many faint Gaussians to delete so that at most `target_count` remain.

    If there are too few faint Gaussians, all of them are deleted, but more than `target_count`
    Gaussians remain.
    """
    header = state.scene.header
    logits = state.scene.codes[OPACITY.start] * header.opacity_step
    faint_count = int(np.count_nonzero(1 / (1 + np.exp(-logits)) < settings.death_opacity))
    return min(max(0, state.scene.count - target_count), faint_count)
