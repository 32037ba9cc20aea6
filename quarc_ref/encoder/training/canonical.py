"""Trains the canonical frame with 3DGS on frame 0; the last iterations quantize attributes.

Training differs from 3DGS in the following ways, all controlled by `CanonicalSettings`:

- Noise on positions (paper section 3) prevents overfitting to the training views. Noise
  along a Gaussian's axes makes the loss insensitive to small shifts of the Gaussian.
- Opacities decay, so that Gaussians that do not improve the pictures disappear. Haze in
  front of the cameras disappears first.
- Gaussians that contribute little are pruned several times during densification, which then
  adds others where the error is greater, and at its end, so that each one is worth its bytes.
- The first iterations may use pictures of half the width and height.
- The last iterations are fine-tuning: all attributes pass through the quantizer, so that
  training optimizes the values that are written. Halfway, codes are chosen that save bits at
  little distortion (`rdoq`).
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
from quarc_ref.encoder.resume.interruption import defer_signals
from quarc_ref.encoder.resume.saved_training import CheckpointBounds
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, densify, sample_offsets
from quarc_ref.encoder.training.pruning import prune_by_contribution
from quarc_ref.encoder.training.rdoq import choose_codes
from quarc_ref.encoder.training.regularizers import code_rate_nats, opacity_scale_penalty
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, to_sh_dc
from quarc_ref.format.errors import EncodeError

_INITIAL_OPACITY = 0.1
_NEIGHBOR_COUNT = 3
_MIN_SPACING = 1e-7
# Evaluating the code rate is slow, so only every second iteration uses it, with twice the weight.
_RATE_INTERVAL = 2


def train_canonical(
    context: TrainingContext,
    points: Points,
    objective: CanonicalObjective,
    checkpoint: Checkpoint | None = None,
) -> Attributes:
    """Train the Gaussians of frame 0.

    Args:
        context: Training views, renderer and random numbers.
        points: Initial points.
        objective: Schedule, weights and quantization steps.
        checkpoint: File in which the training state is saved every minute and when training is
            interrupted, and from which training resumes. If `checkpoint` is None, nothing is
            saved.

    Returns:
        The quantized attributes of the trained Gaussians, except nearly transparent ones.

    Raises:
        EncodeError: All Gaussians became transparent.
        OSError: The checkpoint cannot be written.
    """
    settings = objective.settings
    training = _Training(context, points, objective)
    if checkpoint is not None:
        training.restore(checkpoint)
    with _save_on_interrupt(training, checkpoint):
        while training.step < settings.iterations:
            with defer_signals():
                training.take_step()
            if checkpoint is not None:
                checkpoint.save_if_due(training.state_arrays)
            context.observers.progress.advance("canonical", training.step, settings.iterations)
        if checkpoint is not None:  # writing the frame takes time and may be interrupted
            checkpoint.save(training.state_arrays)
    attributes = training.attributes.quantized(objective.header)
    is_kept = torch.sigmoid(attributes.opacities) >= settings.final_prune_opacity
    if not bool(is_kept.any()):
        message = (
            "all Gaussians of the first frame became transparent in training: check that its "
            "pictures are not black (encode --start chooses another first frame)"
        )
        raise EncodeError(message)
    return attributes.rows(is_kept)


class _Training:
    """Trains the Gaussians of frame 0 step by step.

    Attributes:
        step: Index of the next iteration, from 0.
    """

    def __init__(
        self, context: TrainingContext, points: Points, objective: CanonicalObjective
    ) -> None:
        settings = objective.settings
        self.step = 0
        self._context, self._objective = context, objective
        self._half_context = context.halved() if settings.half_resolution_until_iter else context
        self._generator = context.generator(0, "canonical")
        self._views = context.views.shuffled_indices(self._generator)
        initial_attributes = initialize_from_points(
            points, settings, self._generator, context.device
        )
        self._initial_count = initial_attributes.means.shape[0]
        self._trainer = Trainer(
            initial_attributes, canonical_learning_rates(settings, context.views.extent)
        )
        self._statistics = ScreenStatistics(self._trainer.count, context.device)

    @property
    def attributes(self) -> Attributes:
        """Detached copies of the current attributes."""
        return self._trainer.attributes.detached()

    def take_step(self) -> None:
        """Run one iteration: prune if scheduled, train on one view, and densify if scheduled."""
        context, objective, trainer = self._context, self._objective, self._trainer
        settings, step = objective.settings, self.step
        pruning = objective.pruning_at(step, self._initial_count)
        if pruning:
            prune_by_contribution(trainer, context, pruning, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        if objective.should_choose_codes(step):
            choose_codes(trainer, context, objective, self._generator)
        trainer.set_learning_rates(learning_rates_at(objective, context.views.extent, step))
        uses_half_resolution = step < settings.half_resolution_until_iter
        self._train_view(self._half_context if uses_half_resolution else context)
        if objective.should_densify(step):
            densify(trainer, self._statistics, settings, context.views.extent, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        self.step += 1

    def state_arrays(self) -> Arrays:
        """Return the complete training state as arrays."""
        tensors = {
            "generator": self._generator.get_state(),
            "gains": self._context.exposures.gains,
            **self._trainer.state(),
            **self._statistics.state(),
        }
        arrays: Arrays = {name: tensor.cpu().numpy() for name, tensor in tensors.items()}
        return arrays | {
            "step": np.array(self.step),
            "left": np.array(self._views.remaining, np.int64),
        }

    def restore(self, checkpoint: Checkpoint) -> None:
        """Restore the state from a checkpoint; leave the state unchanged if the file is invalid."""
        gaussian_arrays = {**self._trainer.state(), **self._statistics.state()}
        settings = self._objective.settings
        bounds = CheckpointBounds(
            gaussians=settings.max_gaussians,
            views=self._context.view_count,
            iterations=settings.iterations,
        )
        arrays = checkpoint.load(bounds.describe_layout(self.state_arrays(), gaussian_arrays))
        if arrays is None or not bounds.are_valid(arrays):
            return
        tensors = {name: torch.from_numpy(array) for name, array in arrays.items()}
        self.step = int(arrays["step"])
        self._views.remaining = arrays["left"].tolist()
        self._generator.set_state(tensors["generator"])
        self._context.exposures.restore(tensors["gains"])
        self._trainer.restore(tensors)
        self._statistics.restore(tensors)

    def _train_view(self, context: TrainingContext) -> None:
        """Render the next training view and take an optimizer step on its loss."""
        objective, trainer, step = self._objective, self._trainer, self.step
        settings = objective.settings
        attributes = _attributes_to_render(trainer.attributes, objective, step, self._generator)
        view = next(self._views)
        rendering = context.render(attributes.activated(), view)
        if settings.exposure_lr and step >= settings.exposure_from_iter:
            image, picture = (
                context.apply_mask(rendering.image, view, 0),
                context.views.picture(view, 0),
            )
            context.exposures.update_gain(view, image, picture, settings.exposure_lr)
        loss = context.photometric_loss(rendering.image, view, 0, settings.lambda_dssim)
        loss = loss + opacity_scale_penalty(trainer.attributes, settings)
        rate_weight = settings.code_rd_lambda * objective.rd_lambda
        if rate_weight and step % _RATE_INTERVAL == 0:
            rate_nats = code_rate_nats(trainer.attributes, objective.header)
            loss = loss + _RATE_INTERVAL * loss.detach() * (rate_weight * rate_nats)
        gradient = trainer.step(loss, rendering.means2d)
        if objective.should_decay_opacity(step):
            trainer.decay_opacity(rendering.radii > 0, settings.opacity_decay)
        self._statistics.add(gradient, rendering, context.camera(view))
        step_numbers = (0, step + 1, settings.iterations)
        context.report_step("canonical", step_numbers, view, trainer.count, rendering.image, loss)


@contextmanager
def _save_on_interrupt(training: _Training, checkpoint: Checkpoint | None) -> Iterator[None]:
    """Save a checkpoint if KeyboardInterrupt is raised in the context, then reraise it."""
    try:
        yield
    except KeyboardInterrupt:
        if checkpoint is not None and training.step:
            with defer_signals():
                checkpoint.save(training.state_arrays)
        raise


def initialize_from_points(
    points: Points, settings: CanonicalSettings, generator: torch.Generator, device: torch.device
) -> Attributes:
    """Create a Gaussian for every initial point.

    If there are more than `settings.initial_gaussians` or `settings.max_gaussians` points, a random
    subset of the smaller size is used. The scale of a Gaussian is the root mean square distance of
    its point to the three nearest other points, as in 3DGS.
    """
    point_count = points.positions.shape[0]
    count = min(point_count, settings.initial_gaussians, settings.max_gaussians)
    indices = torch.randperm(point_count, generator=generator)[:count].numpy()
    positions = points.positions[indices].astype(np.float64)
    log_scales = np.log(_measure_spacing(positions))
    colors = points.colors[indices] / 255
    identity_quaternion = torch.tensor([1.0, 0.0, 0.0, 0.0])
    opacity_logit = math.log(_INITIAL_OPACITY / (1 - _INITIAL_OPACITY))
    tensors = (
        torch.tensor(positions, dtype=torch.float32),
        identity_quaternion.repeat(count, 1),
        torch.tensor(log_scales, dtype=torch.float32)[:, None].repeat(1, 3),
        torch.full((count,), opacity_logit),
        to_sh_dc(torch.tensor(colors)).to(torch.float32)[:, None],
        torch.zeros(count, 3, 3),
    )
    return Attributes(*(tensor.to(device) for tensor in tensors))


def _measure_spacing(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the `[n]` root mean square distances of points to their three nearest neighbors."""
    neighbor_ranks = list(range(2, 2 + min(_NEIGHBOR_COUNT, positions.shape[0] - 1)))
    if not neighbor_ranks:
        return np.ones(positions.shape[0])
    distances, _ = cKDTree(positions).query(positions, k=neighbor_ranks)
    spacing: NDArray[np.float64] = np.sqrt(np.mean(np.square(distances), axis=1))
    return np.maximum(spacing, _MIN_SPACING)


def canonical_learning_rates(settings: CanonicalSettings, extent: float) -> tuple[float, ...]:
    """Return the initial learning rate of each attribute, in the order of `Attributes`."""
    return (
        settings.position_lr * extent,
        settings.rotation_lr,
        settings.scale_lr,
        settings.opacity_lr,
        settings.sh_dc_lr,
        settings.sh_rest_lr,
    )


def learning_rates_at(objective: CanonicalObjective, extent: float, step: int) -> list[float]:
    """Return the learning rate of each attribute in an iteration, in the order of `Attributes`.

    The learning rate of positions decays exponentially from the first to the last iteration.
    During fine-tuning, all learning rates are also multiplied by a cosine decay.
    """
    settings = objective.settings
    progress = step / settings.iterations
    log_initial, log_final = math.log(settings.position_lr), math.log(settings.position_lr_final)
    position_lr = math.exp(log_initial + (log_final - log_initial) * progress) * extent
    fine_tuning_step = step - objective.fine_tuning_start
    decay = 1.0
    if fine_tuning_step >= 0:
        decay = cosine_decay(
            fine_tuning_step, settings.iterations - step + fine_tuning_step, settings.lr_end_factor
        )
    other_lrs = canonical_learning_rates(settings, extent)[1:]
    return [decay * lr for lr in (position_lr, *other_lrs)]


def _attributes_to_render(
    attributes: Attributes,
    objective: CanonicalObjective,
    step: int,
    generator: torch.Generator,
) -> Attributes:
    """Return the attributes that an iteration renders.

    Noise is added to positions, SH degree 1 is 0 before `sh_from_iter`, and all attributes
    are quantized during fine-tuning.
    """
    settings, header, fine_tuning_start = (
        objective.settings,
        objective.header,
        objective.fine_tuning_start,
    )
    noise = torch.randn(attributes.means.shape, generator=generator) * settings.position_noise
    noise = noise.to(attributes.means.device)
    if step < fine_tuning_start and settings.axis_noise:
        noise_factor = settings.axis_noise * (1 - step / fine_tuning_start)
        noise = noise + sample_offsets(attributes.detached(), noise_factor, generator)
    if step >= fine_tuning_start:
        attributes = attributes.quantized(header)
    has_sh_rest = header.sh_degree > 0 and step >= settings.sh_from_iter
    return Attributes(
        attributes.means + noise,
        attributes.rotations,
        attributes.log_scales,
        attributes.opacities,
        attributes.sh_dc,
        attributes.sh_rest if has_sh_rest else torch.zeros_like(attributes.sh_rest),
    )
