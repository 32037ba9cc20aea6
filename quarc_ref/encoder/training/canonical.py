"""Trains frame 0: an ensemble of scenes, of which the last is written.

The other scenes of the ensemble are trained only until pseudo-views are first used, and only
serve to render these views. An ensemble of one scene has no pseudo-views.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile

import numpy as np
import torch
from torch import Tensor

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.resume.array_file import Arrays
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.resume.interruption import defer_signals
from quarc_ref.encoder.resume.saved_training import GAUSSIANS, CheckpointBounds
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.pseudo_views import PseudoViews
from quarc_ref.encoder.training.scene_training import SceneTraining, require_gaussians
from quarc_ref.encoder.training.trainable import ATTRIBUTE_NAMES, Attributes


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
    training = _EnsembleTraining(context, points, objective)
    if checkpoint is not None:
        training.restore(checkpoint)
    with _save_on_interrupt(training, checkpoint):
        while training.step < settings.training_steps:
            with defer_signals():
                training.take_step()
            if checkpoint is not None:
                checkpoint.save_if_due(training.state_arrays)
            context.observers.progress.advance("canonical", training.step, settings.training_steps)
        if checkpoint is not None:  # writing the frame takes time and may be interrupted
            checkpoint.save(training.state_arrays)
    attributes = training.attributes.quantized(objective.header)
    is_kept = torch.sigmoid(attributes.opacities) >= settings.final_prune_opacity
    require_gaussians(int(is_kept.sum()))
    return attributes.rows(is_kept)


class _EnsembleTraining:
    """Trains the scenes of the ensemble, one after the other.

    When pseudo-views are first used, the last scene becomes a part of the ensemble, too.
    """

    def __init__(
        self, context: TrainingContext, points: Points, objective: CanonicalObjective
    ) -> None:
        self._context, self._points, self._objective = context, points, objective
        self._settings = objective.settings
        self._ensemble: list[Attributes] = []
        self._scene = self._start_scene()

    @property
    def step(self) -> int:
        """Number of finished iterations of all scenes."""
        return self._scene.first_step + self._scene.step

    @property
    def attributes(self) -> Attributes:
        """Detached copies of the current attributes of the scene in training."""
        return self._scene.attributes

    def take_step(self) -> None:
        """Run one iteration of the current scene, or the first one of the next scene."""
        settings = self._settings
        if settings.scene_count > 1 and self._scene.step == settings.pseudo_view_steps.start:
            self._ensemble.append(self._scene.attributes)
            if len(self._ensemble) < settings.scene_count:
                self._scene = self._start_scene()
            self._add_pseudo_views()
        self._scene.take_step()

    def state_arrays(self) -> Arrays:
        """Return the complete training state as arrays."""
        tensors = self._scene.state() | self._ensemble_state()
        arrays: Arrays = {name: tensor.cpu().numpy() for name, tensor in tensors.items()}
        return arrays | {"step": np.array(self.step)}

    def restore(self, checkpoint: Checkpoint) -> None:
        """Restore the state from a checkpoint; leave the state unchanged if the file is invalid."""
        bounds = CheckpointBounds(
            gaussians=self._settings.max_gaussians,
            views=self._context.view_count,
            iterations=self._settings.training_steps,
        )
        row_names = dict.fromkeys(self._scene.gaussian_state(), GAUSSIANS)
        row_names |= {name: name.split(".")[0] for name in self._ensemble_state()}
        arrays = checkpoint.load(bounds.describe_layout(self.state_arrays(), row_names))
        if arrays is None or not bounds.are_valid(arrays):
            return
        tensors = {name: torch.from_numpy(array) for name, array in arrays.items()}
        step = int(arrays["step"])
        ensemble = self._read_ensemble(tensors)
        if len(ensemble) != self._settings.count_ensemble(step):
            return
        self._ensemble = ensemble
        self._scene = self._start_scene()
        self._scene.restore(step - self._scene.first_step, tensors)
        self._add_pseudo_views()

    def _start_scene(self) -> SceneTraining:
        """Return the training of the first scene that is not finished."""
        context, last_index = self._context, self._settings.scene_count - 1
        index = min(len(self._ensemble), last_index)
        if index < last_index:
            context = replace(context, exposures=Exposures(context.view_count, context.device))
        return SceneTraining(context, self._points, self._objective, index)

    def _add_pseudo_views(self) -> None:
        """Let the last scene train on pseudo-views, if the ensemble is complete."""
        settings = self._settings
        if 1 < settings.scene_count == len(self._ensemble):
            is_half = settings.pseudo_view_steps.start <= settings.half_resolution_until_iter
            self._scene.pseudo_views = PseudoViews(
                self._ensemble,
                self._context.views.cameras,
                2 if is_half else 1,
                self._context.rasterizer,
            )

    def _ensemble_state(self) -> dict[str, Tensor]:
        """Return the attributes of the ensemble by name; scenes without rows are missing."""
        if self._settings.scene_count == 1:
            return {}
        scene = self._scene.attributes
        missing_scene = scene.rows(torch.zeros(0, dtype=torch.long, device=self._context.device))
        missing_count = self._settings.scene_count - len(self._ensemble)
        scenes = self._ensemble + missing_count * [missing_scene]
        return {
            f"{_scene_name(index)}.{name}": tensor
            for index, attributes in enumerate(scenes)
            for name, tensor in zip(ATTRIBUTE_NAMES, attributes.tensors(), strict=True)
        }

    def _read_ensemble(self, state: dict[str, Tensor]) -> list[Attributes]:
        """Return the scenes before the first missing one."""
        if self._settings.scene_count == 1:
            return []
        scenes = (
            Attributes(
                *(
                    state[f"{_scene_name(index)}.{name}"].to(self._context.device)
                    for name in ATTRIBUTE_NAMES
                )
            )
            for index in range(self._settings.scene_count)
        )
        return list(takewhile(lambda scene: scene.means.shape[0], scenes))


def _scene_name(index: int) -> str:
    return f"scene {index}"


@contextmanager
def _save_on_interrupt(
    training: _EnsembleTraining, checkpoint: Checkpoint | None
) -> Iterator[None]:
    """Save a checkpoint if KeyboardInterrupt is raised in the context, then reraise it."""
    try:
        yield
    except KeyboardInterrupt:
        if checkpoint is not None and training.step:
            with defer_signals():
                checkpoint.save(training.state_arrays)
        raise
