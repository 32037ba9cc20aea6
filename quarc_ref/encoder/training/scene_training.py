"""Trains one scene of frame 0, step by step.

Training differs from 3DGS in the following ways, all controlled by `CanonicalSettings`:

- Noise on positions (paper section 3) prevents overfitting to the training views. Noise
  along a Gaussian's axes makes the loss insensitive to small shifts of the Gaussian.
- Opacities decay, so that Gaussians that do not improve the pictures disappear. Haze in
  front of the cameras disappears first.
- Gaussians that contribute little are pruned several times during densification, which then
  adds others where the error is greater, and several times after it, so that each one is worth
  its bytes.
- The first iterations may use pictures of half the width and height.
- The last iterations are fine-tuning: all attributes pass through the quantizer, so that
  training optimizes the values that are written. Halfway, codes are chosen that save bits at
  little distortion (`rdoq`).
- During densification, some iterations may train on a pseudo-view besides their training view.

Schedule of preset `main`; the scenes of the ensemble before the last one end at iteration 1500:

    0 to 2299       pictures of half the width and height
    0 to 3599       noise along the axes
    100 to 3999     exposures
    300 to 2600     densification, every 100 iterations; prunings at 675, 1350 and 2025
    300 to 3599     opacity decay
    1500 to 2699    pseudo-views
    2400 to 3999    SH degree 1, if the stream has it (not in `main`)
    2700 to 3487    8 prunings by threshold
    3600 to 3999    fine-tuning; choice of codes at 3800
"""

from dataclasses import replace

import torch
from torch import Tensor

from quarc_ref.datasets.calibration import downscale_camera
from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, densify, sample_offsets
from quarc_ref.encoder.training.initialization import initialize_from_points
from quarc_ref.encoder.training.learning_rates import (
    canonical_learning_rates,
    learning_rates_at,
)
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.pruning import prune_by_contribution
from quarc_ref.encoder.training.pseudo_views import PseudoView, PseudoViews
from quarc_ref.encoder.training.rdoq import choose_codes
from quarc_ref.encoder.training.regularizers import code_rate_nats, opacity_scale_penalty
from quarc_ref.encoder.training.trainable import Attributes, Trainer
from quarc_ref.encoder.training.views import average_squares
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import EncodeError
from quarc_ref.rendering.rasterizer import Rendering

# Evaluating the code rate is slow, so only every second iteration uses it, with twice the weight.
_RATE_INTERVAL = 2


class SceneTraining:
    """Training of a scene from the initial points.

    Args:
        context: Training views, renderer and random numbers.
        points: Initial points.
        objective: Schedule, weights and quantization steps.
        index: Index of the scene in the ensemble; each scene has other random numbers.

    Attributes:
        first_step: Number of iterations of the scenes before this one.
        step: Index of the next iteration, from 0.
        pseudo_views: Pseudo-views to train on besides the training views; None for none.
    """

    def __init__(
        self,
        context: TrainingContext,
        points: Points,
        objective: CanonicalObjective,
        index: int,
    ) -> None:
        settings = objective.settings
        self.first_step = index * settings.pseudo_view_steps.start
        self._is_written = index == settings.scene_count - 1
        self.step = 0
        self.pseudo_views: PseudoViews | None = None
        self._context, self._objective = context, objective
        self._half_context = context.halved() if settings.half_resolution_until_iter else context
        self._generator = context.generator(0, f"canonical {index}" if index else "canonical")
        self._views = context.views.shuffled_indices(self._generator, 0)
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
        """Run one iteration: prune if scheduled, train on a view, and densify if scheduled.

        Some iterations train on a pseudo-view besides their training view.

        Raises:
            EncodeError: All Gaussians became transparent.
        """
        context, objective, trainer = self._context, self._objective, self._trainer
        settings, step = objective.settings, self.step
        pruning = objective.pruning_at(step, self._initial_count)
        if pruning:
            prune_by_contribution(trainer, context, pruning, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
        if objective.should_choose_codes(step):
            choose_codes(trainer, context, objective, self._generator)
        trainer.set_learning_rates(learning_rates_at(settings, context.views.extent, step))
        self._train_view()
        pseudo_view = self._draw_pseudo_view()
        if pseudo_view is not None:
            self._train_pseudo_view(pseudo_view)
        if objective.should_densify(step):
            densify(trainer, self._statistics, settings, context.views.extent, self._generator)
            self._statistics = ScreenStatistics(trainer.count, context.device)
            require_gaussians(trainer.count)
        self.step += 1

    def state(self) -> dict[str, Tensor]:
        """Return the complete training state by name, except `step` and `pseudo_views`."""
        return {
            "generator": self._generator.get_state(),
            "gains": self._context.exposures.gains,
            "left": torch.tensor(self._views.remaining, dtype=torch.int64),
            **self.gaussian_state(),
        }

    def gaussian_state(self) -> dict[str, Tensor]:
        """Return the part of the training state that has a row per Gaussian, or is a scalar."""
        return {**self._trainer.state(), **self._statistics.state()}

    def restore(self, step: int, state: dict[str, Tensor]) -> None:
        """Continue with iteration `step` from a saved training state."""
        self.step = step
        self._views.remaining = state["left"].tolist()
        self._generator.set_state(state["generator"])
        self._context.exposures.restore(state["gains"])
        self._trainer.restore(state)
        self._statistics.restore(state)

    @property
    def _has_sh_rest(self) -> bool:
        """Whether the current iteration trains SH degree 1."""
        objective = self._objective
        return objective.header.sh_degree > 0 and self.step >= objective.settings.sh_from_iter

    @property
    def _step_context(self) -> TrainingContext:
        """The context whose pictures have the size that the current iteration uses."""
        uses_half_resolution = self.step < self._objective.settings.half_resolution_until_iter
        return self._half_context if uses_half_resolution else self._context

    def _draw_pseudo_view(self) -> PseudoView | None:
        """Return a pseudo-view, or None if this iteration uses none."""
        settings = self._objective.settings
        if self.pseudo_views is None or self.step not in settings.pseudo_view_steps:
            return None
        number = float(torch.rand((), generator=self._generator))
        if number >= settings.pseudo_view_ratio:
            return None
        return self.pseudo_views.draw(self._generator)

    def _train_view(self) -> None:
        """Render the next training view and take an optimizer step on its loss."""
        context, settings, step = self._step_context, self._objective.settings, self.step
        attributes = self._attributes_to_render()
        view = next(self._views)
        rendering = context.render(attributes.activated(), view)
        if settings.exposure_lr and step >= settings.exposure_from_iter:
            background = context.background(view)
            image, picture = context.exposure_pair(rendering, background, view, 0)
            context.exposures.update_gain(view, image, picture, settings.exposure_lr)
        loss = context.photometric_loss(rendering.image, view, 0, settings.lambda_dssim)
        total_loss = self._optimize(loss, rendering, context.camera(view))
        step_numbers = (0, self.first_step + step + 1, settings.training_steps)
        context.report_step(
            "canonical", step_numbers, view, self._trainer.count, rendering.image, total_loss
        )

    def _train_pseudo_view(self, pseudo_view: PseudoView) -> None:
        """Render a pseudo-view and take an optimizer step on its loss."""
        context = self._step_context
        attributes = self._attributes_to_render()
        downscale = 1 if context is self._context else 2
        camera = downscale_camera(pseudo_view.camera, downscale)
        background = torch.zeros(3, device=context.device)
        rendering = context.rasterizer.render(attributes.activated(), camera, background)
        image = average_squares(rendering.image, pseudo_view.downscale // downscale)
        loss = photometric_loss(image, pseudo_view.picture, self._objective.settings.lambda_dssim)
        self._optimize(loss, rendering, camera)

    def _optimize(self, loss: Tensor, rendering: Rendering, camera: Camera) -> Tensor:
        """Take an optimizer step; then decay opacities and add to the densification statistics.

        Args:
            loss: Photometric loss of a rendering.
            rendering: The rendering.
            camera: Its camera.

        Returns:
            The loss with its regularization and rate terms.
        """
        objective, trainer, step = self._objective, self._trainer, self.step
        loss = self._add_regularizers_and_rate(loss)
        gradient = trainer.step(loss, rendering.means2d)
        if objective.should_decay_opacity(step):
            trainer.decay_opacity(rendering.radii > 0, objective.settings.opacity_decay)
        if step < objective.settings.densification_end:
            self._statistics.add(gradient, rendering, camera)
        return loss

    def _add_regularizers_and_rate(self, loss: Tensor) -> Tensor:
        """Return the loss of an iteration: a photometric loss plus the terms of `regularizers`."""
        objective, attributes = self._objective, self._trainer.attributes
        loss = loss + opacity_scale_penalty(attributes, objective.settings)
        rate_weight = objective.settings.code_rd_lambda * objective.rd_factor
        if self._is_written and rate_weight and self.step % _RATE_INTERVAL == 0:
            rate_nats = code_rate_nats(attributes, objective.header, has_sh_rest=self._has_sh_rest)
            loss = loss + _RATE_INTERVAL * loss.detach() * (rate_weight * rate_nats)
        return loss

    def _attributes_to_render(self) -> Attributes:
        """Return the attributes that the current iteration renders.

        Noise is added to positions, SH degree 1 is left out before `sh_from_iter`, and all
        attributes are quantized during fine-tuning.
        """
        attributes, generator, step = self._trainer.attributes, self._generator, self.step
        settings, header = self._objective.settings, self._objective.header
        fine_tuning_start = settings.fine_tuning_start
        noise = torch.zeros_like(attributes.means)
        if settings.position_noise:
            normals = torch.randn(noise.shape, generator=generator).to(noise.device)
            noise += settings.position_noise * normals
        if step < fine_tuning_start and settings.axis_noise:
            noise_factor = settings.axis_noise * (1 - step / fine_tuning_start)
            with torch.no_grad():
                noise += sample_offsets(attributes, noise_factor, generator)
        if step >= fine_tuning_start:
            attributes = attributes.quantized(header)
        sh_rest = attributes.sh_rest
        if not self._has_sh_rest:
            sh_rest = sh_rest.detach()[:, :0]
        return replace(attributes, means=attributes.means + noise, sh_rest=sh_rest)


def require_gaussians(count: int) -> None:
    """Raise EncodeError if no Gaussian is left."""
    if not count:
        message = (
            "all Gaussians of the first frame became transparent in training: check that its "
            "pictures are not black (encode --start chooses another first frame)"
        )
        raise EncodeError(message)
