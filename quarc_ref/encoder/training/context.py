"""Shared context of training: views, renderer and random numbers.

Random numbers depend only on (seed, frame, purpose), so that training of any frame can be
repeated from the previous decoded state.
"""

import hashlib
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from quarc_ref.encoder.monitoring.monitor import Monitor, NullMonitor, TrainingStep
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, Rasterizer, Rendering


@dataclass(frozen=True, slots=True)
class Observers:
    """Callbacks during training, which do not affect its result.

    Attributes:
        progress: Called after every step.
        monitor: Called for every training step and frame.
    """

    progress: Progress = field(default_factory=NullProgress)
    monitor: Monitor = field(default_factory=NullMonitor)


@dataclass(frozen=True, slots=True, eq=False)
class TrainingContext:
    """The training views of a capture, and the means to render them.

    Attributes:
        views: The training views.
        rasterizer: Renderer on the device of the views.
        seed: Seed of all random numbers.
        exposures: Exposures of the training views.
        observers: Callbacks during training.
    """

    views: TrainingViews
    rasterizer: Rasterizer
    seed: int
    exposures: Exposures
    observers: Observers = field(default_factory=Observers)

    @property
    def device(self) -> torch.device:
        """Device of the tensors."""
        return self.views.device

    def halved(self) -> "TrainingContext":
        """Return a context with half the width and height of pictures."""
        return replace(self, views=self.views.halved())

    @property
    def view_count(self) -> int:
        """Number of training views."""
        return len(self.views.cameras)

    def camera(self, view: int) -> Camera:
        """Return the camera of a view."""
        return self.views.cameras[view]

    def render(self, gaussians: Gaussians, view: int) -> Rendering:
        """Render a view with a black background."""
        background = torch.zeros(3, device=self.device)
        return self.rasterizer.render(gaussians, self.camera(view), background)

    def render_backdrop(self, gaussians: Gaussians, view: int) -> Backdrop:
        """Render a view as a backdrop to which Gaussians can be added."""
        background = torch.zeros(3, device=self.device)
        return self.rasterizer.render_backdrop(gaussians, self.camera(view), background)

    def report_step(  # noqa: PLR0913, what a step is cannot be said with less
        self,
        stage: str,
        place: tuple[int, int, int],
        view: int,
        gaussians: int,
        image: Tensor,
        loss: Tensor,
    ) -> None:
        """Report a training step.

        Args:
            stage: Stage, as in `TrainingStep`.
            place: Frame, step (from 1), and number of steps of the stage.
            view: Index of the view.
            gaussians: Number of rendered Gaussians.
            image: `[H, W, 3]` rendering.
            loss: Scalar loss.
        """
        frame, step, steps = place

        def recall_truth() -> Tensor:
            return self.truth(view, frame)

        mask = self.views.mask(view, frame)
        self.observers.monitor.step(
            TrainingStep(stage, frame, step, steps, gaussians, loss, image, recall_truth, mask)
        )

    def truth(self, view: int, frame: int) -> Tensor:
        """Return the `[H, W, 3]` picture of a view with corrected exposure, black where masked."""
        return self.exposures.correct(self.views.picture(view, frame), view)

    def mask(self, image: Tensor, view: int, frame: int) -> Tensor:
        """Set the masked pixels of an image `[H, W, 3]` of a view to black.

        Images must be masked before they are compared with `truth`, so that masked pixels
        have no error and no gradient. Without a mask, the same tensor is returned.
        """
        mask = self.views.mask(view, frame)
        return image if mask is None else image * mask

    def photometric_loss(self, image: Tensor, view: int, frame: int, dssim: float) -> Tensor:
        """Return the loss of a rendered view against its picture, ignoring masked pixels.

        Args:
            image: `[H, W, 3]` rendered view.
            view: Index of the view.
            frame: Ordinal of the frame.
            dssim: Weight of D-SSIM in the loss.
        """
        return photometric_loss(self.mask(image, view, frame), self.truth(view, frame), dssim)

    def generator(self, frame: int, purpose: str) -> torch.Generator:
        """Return a CPU random generator for a purpose in a frame."""
        name = f"{self.seed}/{frame}/{purpose}".encode()
        seed = int.from_bytes(hashlib.sha256(name).digest()[:8], "little") >> 1
        return torch.Generator().manual_seed(seed)
