"""Training of the canonical frame: 3DGS on frame 0, ending on the format's grid.

Noise on the positions (paper section 3) keeps the scene from fitting its views
to the pixel; along each Gaussian's own axes it says that a place within the
Gaussian is as good as another. Opacities fade all the while, so that only what
the pictures ask for again and again stays: haze before a camera goes first.
Halfway through densification, and when it is over, the Gaussians that the
pictures would not miss go; what is left has time to take their place, and trains
the faster. The first iterations may use pictures of half the size
(`half_resolution_until_iter`). The last part of the schedule is fine-tuning: all attributes pass
through the quantizer, so that what is written is what was trained, but for
Gaussians hardly there (`final_prune_opacity`).
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
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, densify, draw_within
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.pruning import prune_by_contribution
from quarc_ref.encoder.training.regularizers import code_rate_penalty, opacity_scale_penalty
from quarc_ref.encoder.training.trainable import Attributes, Trainer, cosine_decay, to_sh_dc
from quarc_ref.format.records import StreamHeader

_OPACITY_AT_START = 0.1
_NEIGHBORS = 3
_LEAST_SPACING = 1e-7
_CODES_EVERY = 2  # steps between two that price codes, at so many times the price: it takes long


def train_canonical(
    context: TrainingContext,
    points: Points,
    settings: CanonicalSettings,
    header: StreamHeader,
    checkpoint: Checkpoint | None = None,
) -> Attributes:
    """Return the trained attributes of frame 0, on the grid of the format.

    Args:
        context: Views, renderer and draws.
        points: Initial points.
        settings: Schedule and thresholds.
        header: The steps to end on.
        checkpoint: Where the training is kept, every minute and when it is interrupted,
            and gone on from; None for nowhere.

    Raises:
        OSError: The checkpoint cannot be written.
    """
    training = _Training(context, points, settings, header)
    if checkpoint is not None:
        training.restore(checkpoint)
    with _save_on_interrupt(training, checkpoint):
        while training.step < settings.iterations:
            with signals_deferred():
                training.take_step()
            if checkpoint is not None:
                checkpoint.save_if_due(training.describe)
            context.progress.advance("canonical", training.step, settings.iterations)
        if checkpoint is not None:  # until the frame is written, which takes a while
            checkpoint.save(training.describe)
    final = training.attributes.quantized(header)
    return final.rows(torch.sigmoid(final.opacities) >= settings.final_prune_opacity)


class _Training:
    """Frame 0 in training.

    Attributes:
        step: The next one.
    """

    def __init__(
        self,
        context: TrainingContext,
        points: Points,
        settings: CanonicalSettings,
        header: StreamHeader,
    ) -> None:
        self.step = 0
        self._context, self._settings, self._header = context, settings, header
        self._halved = context.halved() if settings.half_resolution_until_iter else context
        self._generator = context.generator(0, "canonical")
        self._views = context.views.shuffled(self._generator)
        start = start_from_points(points, settings, self._generator, context.device)
        self._trainer = Trainer(start, canonical_learning_rates(settings, context.extent))
        self._statistics = ScreenStatistics(self._trainer.count, context.device)

    @property
    def attributes(self) -> Attributes:
        """What there is so far."""
        return self._trainer.attributes.detached()

    def take_step(self) -> None:
        """Compare one view, and go down the slope; at times, drop and add Gaussians."""
        context, settings, trainer, step = self._context, self._settings, self._trainer, self.step
        price = _price_at(settings, step)
        if price:
            prune_by_contribution(trainer, context, price, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        trainer.set_learning_rates(learning_rates_at(settings, context.extent, step))
        self._compare(self._halved if step < settings.half_resolution_until_iter else context)
        if _densifies(settings, step):
            densify(trainer, self._statistics, settings, context.extent, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        self.step += 1

    def describe(self) -> Arrays:
        """Return all that the next step needs."""
        tensors = {
            "generator": self._generator.get_state(),
            "gains": self._context.exposures.gains,
            **self._trainer.state(),
            **self._statistics.state(),
        }
        arrays: Arrays = {name: tensor.cpu().numpy() for name, tensor in tensors.items()}
        return arrays | {"step": np.array(self.step), "left": np.array(self._views.left, np.int64)}

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go on from what a checkpoint holds of this training, if it holds anything."""
        of_gaussians = {**self._trainer.state(), **self._statistics.state()}
        bounds = Bounds(
            gaussians=max(self._settings.max_gaussians, self._trainer.count),
            views=len(self._context.views.cameras),
            iterations=self._settings.iterations,
        )
        saved = checkpoint.load(bounds.describe_layout(self.describe(), of_gaussians))
        if saved is None or not bounds.allow(saved):
            return
        tensors = {name: torch.from_numpy(array) for name, array in saved.items()}
        self.step = int(saved["step"])
        self._views.left = saved["left"].tolist()
        self._generator.set_state(tensors["generator"])
        self._context.exposures.restore(tensors["gains"])
        self._trainer.restore(tensors)
        self._statistics.restore(tensors)

    def _compare(self, context: TrainingContext) -> None:
        """Compare the next view with its picture, and take the step."""
        settings, header, trainer, step = self._settings, self._header, self._trainer, self.step
        attributes = _as_drawn(trainer.attributes, settings, header, step, self._generator)
        view = next(self._views)
        rendering = context.render(attributes.activated(), view)
        if settings.exposure_lr and step >= settings.exposure_from_iter:
            picture = context.views.picture(view, 0)
            context.exposures.observe(view, rendering.image, picture, settings.exposure_lr)
        loss = photometric_loss(rendering.image, context.truth(view, 0), settings.lambda_dssim)
        loss = loss + opacity_scale_penalty(trainer.attributes, settings)
        if step % _CODES_EVERY == 0:
            dear = _CODES_EVERY * loss.detach()
            loss = loss + dear * code_rate_penalty(trainer.attributes, settings, header)
        gradient = trainer.step(loss, rendering.means2d)
        if settings.opacity_decay and settings.densify_from_iter <= step < _first_fine_step(
            settings
        ):
            trainer.fade(rendering.radii > 0, settings.opacity_decay)
        self._statistics.add(gradient, rendering, context.camera(view))
        place = (0, step + 1, settings.iterations)
        context.report_step("canonical", place, view, trainer.count, rendering.image, loss)


@contextmanager
def _save_on_interrupt(training: _Training, checkpoint: Checkpoint | None) -> Iterator[None]:
    """Save a training that is interrupted between two of its steps."""
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
    """Return a Gaussian for every initial point, or for a draw of them if they are too many.

    A Gaussian is as large as its point is far from its nearest three.
    """
    count = min(points.positions.shape[0], settings.initial_gaussians)
    chosen = torch.randperm(points.positions.shape[0], generator=generator)[:count].numpy()
    positions = points.positions[chosen].astype(np.float64)
    log_scales = np.log(_measure_spacing(positions))
    colors = points.colors[chosen] / 255
    quaternion = torch.tensor([1.0, 0.0, 0.0, 0.0])
    opacity = math.log(_OPACITY_AT_START / (1 - _OPACITY_AT_START))
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
    """Return `[n]` the root mean square distance of points to their nearest three."""
    neighbors = list(range(2, 2 + min(_NEIGHBORS, positions.shape[0] - 1)))
    if not neighbors:
        return np.ones(positions.shape[0])
    distances, _ = cKDTree(positions).query(positions, k=neighbors)
    spacing: NDArray[np.float64] = np.sqrt(np.mean(np.square(distances), axis=1))
    return np.maximum(spacing, _LEAST_SPACING)


def canonical_learning_rates(settings: CanonicalSettings, extent: float) -> tuple[float, ...]:
    """Return the learning rates in the order of `Attributes`."""
    return (
        settings.position_lr * extent,
        settings.rotation_lr,
        settings.scale_lr,
        settings.opacity_lr,
        settings.sh_dc_lr,
        settings.sh_rest_lr,
    )


def learning_rates_at(settings: CanonicalSettings, extent: float, step: int) -> list[float]:
    """Return the rates of a step; those of positions fall all along, all fall in fine-tuning."""
    share = step / settings.iterations
    first, last = math.log(settings.position_lr), math.log(settings.position_lr_final)
    position_lr = math.exp(first + (last - first) * share) * extent
    fine = step - _first_fine_step(settings)
    left = 1.0
    if fine >= 0:
        left = cosine_decay(fine, settings.iterations - step + fine, settings.lr_end_factor)
    return [left * rate for rate in (position_lr, *canonical_learning_rates(settings, extent)[1:])]


def _price_at(settings: CanonicalSettings, step: int) -> float:
    """Return what a Gaussian must be good for to be there from a step on, or 0.

    Halfway it is half of the price: who has come late has not found a place yet.
    """
    last = min(settings.densify_until_iter, _first_fine_step(settings))
    if step == last // 2:
        return settings.prune_rd_lambda / 2
    return settings.prune_rd_lambda if step == last else 0.0


def _first_fine_step(settings: CanonicalSettings) -> int:
    """Return the first step that goes through the quantizer."""
    return math.ceil(settings.quantize_from * settings.iterations)


def _as_drawn(
    attributes: Attributes,
    settings: CanonicalSettings,
    header: StreamHeader,
    step: int,
    generator: torch.Generator,
) -> Attributes:
    """Return what a step draws: noisy, without SH at first, and quantized at last."""
    noise = torch.randn(attributes.means.shape, generator=generator) * settings.position_noise
    noise = noise.to(attributes.means.device)
    fine = _first_fine_step(settings)
    if step < fine and settings.axis_noise:
        spread = settings.axis_noise * (1 - step / fine)
        noise = noise + draw_within(attributes.detached(), spread, generator)
    if step >= fine:
        attributes = attributes.quantized(header)
    with_sh = header.sh_degree > 0 and step >= settings.sh_from_iter
    return Attributes(
        attributes.means + noise,
        attributes.rotations,
        attributes.log_scales,
        attributes.opacities,
        attributes.sh_dc,
        attributes.sh_rest if with_sh else torch.zeros_like(attributes.sh_rest),
    )


def _densifies(settings: CanonicalSettings, step: int) -> bool:
    within = settings.densify_from_iter <= step < settings.densify_until_iter
    return within and step % settings.densification_interval == 0
