"""Trains the canonical frame: 3DGS on frame 0, with attributes on the format's grid at the end.

Differences from 3DGS, all controlled by `CanonicalSettings`:

- Noise on positions (paper section 3) prevents overfitting of the training views; noise
  along each Gaussian's axes makes positions within a Gaussian equivalent.
- Opacities decay, so that only Gaussians that the pictures need remain. Haze in front of
  the cameras disappears first.
- Gaussians that contribute little are pruned halfway through densification and after it.
  The others have time to replace them, and training becomes faster.
- The first iterations may use pictures of half the size.
- The last part is fine-tuning: all attributes pass through the quantizer, so that
  training optimizes the values that are written.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.resume.array_file import Arrays
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.resume.interruption import signals_deferred
from quarc_ref.encoder.resume.saved_training import Bounds
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, densify, draw_within
from quarc_ref.encoder.training.pruning import prune_by_contribution
from quarc_ref.encoder.training.regularizers import code_rate_nats, opacity_scale_penalty
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, to_sh_dc

_INITIAL_OPACITY = 0.1
_NEIGHBORS = 3
_MIN_SPACING = 1e-7
_RATE_EVERY = 2  # the slow code rate is evaluated every second iteration, at twice the weight


def train_canonical(
    context: TrainingContext,
    points: Points,
    objective: CanonicalObjective,
    checkpoint: Checkpoint | None = None,
) -> Attributes:
    """Train frame 0.

    Args:
        context: Training views, renderer and random numbers.
        points: Initial points.
        objective: Schedule, weights and quantization steps.
        checkpoint: File in which training is saved every minute and on interruptions, and
            from which it resumes; None for no file.

    Returns:
        The quantized attributes.

    Raises:
        OSError: The checkpoint cannot be written.
    """
    settings = objective.settings
    training = _Training(context, points, objective)
    if checkpoint is not None:
        training.restore(checkpoint)
    with _save_on_interrupt(training, checkpoint):
        while training.step < settings.iterations:
            with signals_deferred():
                training.take_step()
            if checkpoint is not None:
                checkpoint.save_if_due(training.describe)
            context.observers.progress.advance("canonical", training.step, settings.iterations)
        if checkpoint is not None:  # kept until the frame is written, which takes some time
            checkpoint.save(training.describe)
    final = training.attributes.quantized(objective.header)
    return final.rows(torch.sigmoid(final.opacities) >= settings.final_prune_opacity)


class _Training:
    """Training of frame 0 in progress.

    Attributes:
        step: Index of the next iteration.
    """

    def __init__(
        self, context: TrainingContext, points: Points, objective: CanonicalObjective
    ) -> None:
        settings = objective.settings
        self.step = 0
        self._context, self._objective = context, objective
        self._halved = context.halved() if settings.half_resolution_until_iter else context
        self._generator = context.generator(0, "canonical")
        self._views = context.views.shuffled(self._generator)
        start = start_from_points(points, settings, self._generator, context.device)
        self._trainer = Trainer(start, canonical_learning_rates(settings, context.views.extent))
        self._statistics = ScreenStatistics(self._trainer.count, context.device)

    @property
    def attributes(self) -> Attributes:
        """The current attributes."""
        return self._trainer.attributes.detached()

    def take_step(self) -> None:
        """Run one iteration: prune if due, train on one view, densify if due."""
        context, objective, trainer = self._context, self._objective, self._trainer
        settings, step = objective.settings, self.step
        weight = objective.prune_weight_at(step)
        if weight:
            prune_by_contribution(trainer, context, weight, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        trainer.set_learning_rates(learning_rates_at(objective, context.views.extent, step))
        is_halved = step < settings.half_resolution_until_iter
        self._train_view(self._halved if is_halved else context)
        if objective.densifies_at(step):
            densify(trainer, self._statistics, settings, context.views.extent, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        self.step += 1

    def describe(self) -> Arrays:
        """Return the complete training state as arrays."""
        tensors = {
            "generator": self._generator.get_state(),
            "gains": self._context.exposures.gains,
            **self._trainer.state(),
            **self._statistics.state(),
        }
        arrays: Arrays = {name: tensor.cpu().numpy() for name, tensor in tensors.items()}
        return arrays | {"step": np.array(self.step), "left": np.array(self._views.left, np.int64)}

    def restore(self, checkpoint: Checkpoint) -> None:
        """Continue from a checkpoint if its state is valid for this training."""
        of_gaussians = {**self._trainer.state(), **self._statistics.state()}
        settings = self._objective.settings
        bounds = Bounds(
            gaussians=max(settings.max_gaussians, self._trainer.count),
            views=self._context.view_count,
            iterations=settings.iterations,
        )
        saved = checkpoint.load(bounds.describe_layout(self.describe(), of_gaussians))
        if saved is None or not bounds.are_valid(saved):
            return
        tensors = {name: torch.from_numpy(array) for name, array in saved.items()}
        self.step = int(saved["step"])
        self._views.left = saved["left"].tolist()
        self._generator.set_state(tensors["generator"])
        self._context.exposures.restore(tensors["gains"])
        self._trainer.restore(tensors)
        self._statistics.restore(tensors)

    def _train_view(self, context: TrainingContext) -> None:
        """Render the next view and take an optimizer step."""
        objective, trainer, step = self._objective, self._trainer, self.step
        settings = objective.settings
        attributes = _as_rendered(trainer.attributes, objective, step, self._generator)
        view = next(self._views)
        rendering = context.render(attributes.activated(), view)
        if settings.exposure_lr and step >= settings.exposure_from_iter:
            shown, picture = context.mask(rendering.image, view, 0), context.views.picture(view, 0)
            context.exposures.update_gain(view, shown, picture, settings.exposure_lr)
        loss = context.photometric_loss(rendering.image, view, 0, settings.lambda_dssim)
        loss = loss + opacity_scale_penalty(trainer.attributes, settings)
        weight = settings.code_rd_lambda * objective.rd_lambda
        if weight and step % _RATE_EVERY == 0:
            nats = code_rate_nats(trainer.attributes, objective.header)
            loss = loss + _RATE_EVERY * loss.detach() * (weight * nats)
        gradient = trainer.step(loss, rendering.means2d)
        if objective.decays_opacity_at(step):
            trainer.decay_opacity(rendering.radii > 0, settings.opacity_decay)
        self._statistics.add(gradient, rendering, context.camera(view))
        place = (0, step + 1, settings.iterations)
        context.report_step("canonical", place, view, trainer.count, rendering.image, loss)


@contextmanager
def _save_on_interrupt(training: _Training, checkpoint: Checkpoint | None) -> Iterator[None]:
    """Save the training when it is interrupted between two iterations."""
    try:
        yield
    except KeyboardInterrupt:
        if checkpoint is not None and training.step:
            with signals_deferred():
                checkpoint.save(training.describe)
        raise


def start_from_points(
    points: Points, settings: CanonicalSettings, generator: torch.Generator, device: torch.device
) -> Attributes:
    """Create a Gaussian for every initial point, or for a random subset if there are too many.

    The size of a Gaussian is the distance to the three nearest points, as in 3DGS.
    """
    count = min(points.positions.shape[0], settings.initial_gaussians)
    chosen = torch.randperm(points.positions.shape[0], generator=generator)[:count].numpy()
    positions = points.positions[chosen].astype(np.float64)
    log_scales = np.log(_measure_spacing(positions))
    colors = points.colors[chosen] / 255
    quaternion = torch.tensor([1.0, 0.0, 0.0, 0.0])
    opacity = math.log(_INITIAL_OPACITY / (1 - _INITIAL_OPACITY))
    attributes = (
        torch.tensor(positions, dtype=torch.float32),
        quaternion.repeat(count, 1),
        torch.tensor(log_scales, dtype=torch.float32)[:, None].repeat(1, 3),
        torch.full((count,), opacity),
        to_sh_dc(torch.tensor(colors)).to(torch.float32)[:, None],
        torch.zeros(count, 3, 3),
    )
    return Attributes(*(tensor.to(device) for tensor in attributes))


def _measure_spacing(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the `[n]` root mean square distances of points to their three nearest neighbors."""
    neighbors = list(range(2, 2 + min(_NEIGHBORS, positions.shape[0] - 1)))
    if not neighbors:
        return np.ones(positions.shape[0])
    distances, _ = cKDTree(positions).query(positions, k=neighbors)
    spacing: NDArray[np.float64] = np.sqrt(np.mean(np.square(distances), axis=1))
    return np.maximum(spacing, _MIN_SPACING)


def canonical_learning_rates(settings: CanonicalSettings, extent: float) -> tuple[float, ...]:
    """Return the initial learning rates, in the order of `Attributes`."""
    return (
        settings.position_lr * extent,
        settings.rotation_lr,
        settings.scale_lr,
        settings.opacity_lr,
        settings.sh_dc_lr,
        settings.sh_rest_lr,
    )


def learning_rates_at(objective: CanonicalObjective, extent: float, step: int) -> list[float]:
    """Return the learning rates of an iteration, in the order of `Attributes`.

    The learning rate of positions decays exponentially during all of training; all
    learning rates decay during fine-tuning.
    """
    settings = objective.settings
    share = step / settings.iterations
    first, last = math.log(settings.position_lr), math.log(settings.position_lr_final)
    position_lr = math.exp(first + (last - first) * share) * extent
    fine = step - objective.fine_step
    decay = 1.0
    if fine >= 0:
        decay = cosine_decay(fine, settings.iterations - step + fine, settings.lr_end_factor)
    others = canonical_learning_rates(settings, extent)[1:]
    return [decay * lr for lr in (position_lr, *others)]


def _as_rendered(
    attributes: Attributes,
    objective: CanonicalObjective,
    step: int,
    generator: torch.Generator,
) -> Attributes:
    """Return the attributes to render: with noise, initially without SH, finally quantized."""
    settings, header, fine = objective.settings, objective.header, objective.fine_step
    noise = torch.randn(attributes.means.shape, generator=generator) * settings.position_noise
    noise = noise.to(attributes.means.device)
    if step < fine and settings.axis_noise:
        spread = settings.axis_noise * (1 - step / fine)
        noise = noise + draw_within(attributes.detached(), spread, generator)
    if step >= fine:
        attributes = attributes.quantized(header)
    has_sh = header.sh_degree > 0 and step >= settings.sh_from_iter
    return Attributes(
        attributes.means + noise,
        attributes.rotations,
        attributes.log_scales,
        attributes.opacities,
        attributes.sh_dc,
        attributes.sh_rest if has_sh else torch.zeros_like(attributes.sh_rest),
    )
