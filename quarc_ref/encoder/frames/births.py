"""Stage 2 of a frame: new Gaussians where something really changed (paper section 5).

The newborn are trained alone, from clones of the Gaussians that the gated
statistic points at; the moved scene behind them is the decoder's and stays as
it is.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.frames.birth_selection import BirthObjective, select_births
from quarc_ref.encoder.frames.placement import place_clones, place_on_errors
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.canonical import canonical_learning_rates
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, split
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.quantize import quantize_births
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, from_splats
from quarc_ref.format.records import Births


def fit_births(
    context: TrainingContext,
    moved: FrameState,
    statistics: ScreenStatistics,
    config: EncoderConfig,
    count_bytes: Callable[[Births], int],
) -> Births | None:
    """Return the newborn of a frame, or None.

    Args:
        context: Views, renderer and draws.
        moved: State after the motion of the frame, decoded.
        statistics: Of stage 1.
        config: Stage 2's settings, and the canonical rates that it multiplies.
        count_bytes: Tells how many bytes births of the frame take.
    """
    settings, frame = config.births, moved.scene.frame
    if settings.iterations == 0:
        return None
    scene = FixedScene(context, from_splats(dequantize(moved.scene), context.device))
    if settings.placement == "gate":
        newborn, parents = place_clones(context, scene.attributes, frame, statistics, settings)
    else:
        newborn, parents = place_on_errors(context, scene, frame, settings)
    if parents.numel() == 0:
        return None
    objective = BirthObjective(context, config, moved, scene, count_bytes)
    newborn, parents = _train(objective, newborn, parents)
    kept = torch.sigmoid(newborn.opacities) >= settings.prune_opacity
    newborn, parents = newborn.rows(kept), parents[kept]
    if parents.numel() == 0:
        return None
    if settings.rd_selection:
        return select_births(objective, newborn, parents)
    return quantize_births(newborn, parents.cpu().numpy(), moved.scene)


def _train(
    objective: BirthObjective, newborn: Attributes, parents: Tensor
) -> tuple[Attributes, Tensor]:
    """Return the newborn trained, and the parent of each."""
    context, settings = objective.context, objective.config.births
    rates = canonical_learning_rates(objective.config.canonical, context.extent)
    trainer = Trainer(newborn, rates)
    generator = context.generator(objective.frame, "births training")
    views = context.views.shuffled(generator)
    statistics = ScreenStatistics(trainer.count, context.device)
    for step in range(settings.iterations):
        if step in settings.split_iters:
            parents = _split_and_prune(objective, trainer, statistics, parents, generator)
            statistics = ScreenStatistics(trainer.count, context.device)
        if trainer.count == 0:
            break
        left = cosine_decay(step, settings.iterations, settings.lr_end_factor)
        trainer.set_learning_rates(settings.lr_factor * left * rate for rate in rates)
        view = next(views)
        rendering, loss = objective.compare(objective.activate(trainer.attributes), view)
        gradient = trainer.step(loss, rendering.means2d)
        statistics.add_last(gradient, rendering, context.camera(view))
        place = (objective.frame, step + 1, settings.iterations)
        count = objective.state.scene.count + trainer.count
        context.report_step("births", place, view, count, rendering.image, loss)
        context.progress.advance("births", step + 1, settings.iterations)
    return trainer.attributes.detached(), parents


def _split_and_prune(
    objective: BirthObjective,
    trainer: Trainer,
    statistics: ScreenStatistics,
    parents: Tensor,
    generator: torch.Generator,
) -> Tensor:
    """Split the large newborn that the loss would move, drop the useless; return the parents."""
    settings, extent = objective.config.births, objective.context.extent
    newborn = trainer.attributes.detached()
    scales = torch.exp(newborn.log_scales.amax(dim=1))
    moved = statistics.mean_gradients() >= settings.grad_threshold
    room = settings.max_births - trainer.count
    large = moved & (scales > settings.max_parent_scale * extent)
    large &= large.cumsum(0) <= room
    kept = torch.sigmoid(newborn.opacities) >= settings.prune_opacity
    kept &= statistics.largest_radii() <= settings.prune_radius
    kept &= scales <= settings.prune_scale * extent
    trainer.replace_rows(kept & ~large, split(newborn.rows(large), generator))
    return torch.cat([parents[kept & ~large], parents[large].repeat(2)])
