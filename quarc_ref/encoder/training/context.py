"""What every stage of training works with: views, a renderer, and draws.

All draws come from (seed, frame, purpose) alone, never from what was drawn
before, so that any frame can be trained anew from the decoded state before it.
"""

import hashlib
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from quarc_ref.encoder.monitoring.monitor import Monitor, NullMonitor, TrainingStep
from quarc_ref.encoder.progress import Progress
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, Rasterizer, Rendering


@dataclass(frozen=True, slots=True, eq=False)
class TrainingContext:
    """The training views of a capture and the means to draw them.

    Attributes:
        views: The training views.
        rasterizer: Draws on `device`.
        device: Where tensors live.
        seed: Of every draw.
        progress: Is told of every step.
        extent: Of the capture, world units (`measure_extent`).
        exposures: Of the training views.
        monitor: Is called for every training step.
    """

    views: TrainingViews
    rasterizer: Rasterizer
    device: torch.device
    seed: int
    progress: Progress
    extent: float
    exposures: Exposures
    monitor: Monitor = field(default_factory=NullMonitor)

    def halved(self) -> "TrainingContext":
        """Return the context with pictures of half the width and half the height."""
        return replace(self, views=self.views.halved())

    @property
    def view_count(self) -> int:
        """Number of training views."""
        return len(self.views.cameras)

    def camera(self, view: int) -> Camera:
        """Return the camera of a view."""
        return self.views.cameras[view]

    def render(self, gaussians: Gaussians, view: int) -> Rendering:
        """Draw what a view sees, before black."""
        background = torch.zeros(3, device=self.device)
        return self.rasterizer.render(gaussians, self.camera(view), background)

    def render_backdrop(self, gaussians: Gaussians, view: int) -> Backdrop:
        """Draw what a view sees, for others to be added."""
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
            stage: As `TrainingStep` has it.
            place: The frame, the step, from 1, and how many the stage has.
            view: That was compared.
            gaussians: How many were drawn.
            image: `[H, W, 3]` what was drawn.
            loss: A scalar.
        """
        frame, step, steps = place

        def recall_truth() -> Tensor:
            return self.truth(view, frame)

        self.monitor.step(
            TrainingStep(stage, frame, step, steps, gaussians, loss, image, recall_truth)
        )

    def truth(self, view: int, frame: int) -> Tensor:
        """Return `[H, W, 3]` the picture of a view, as the mean camera would have taken it."""
        return self.exposures.correct(self.views.picture(view, frame), view)

    def generator(self, frame: int, purpose: str) -> torch.Generator:
        """Return the source of all draws of a purpose in a frame, on the CPU."""
        name = f"{self.seed}/{frame}/{purpose}".encode()
        seed = int.from_bytes(hashlib.sha256(name).digest()[:8], "little") >> 1
        return torch.Generator().manual_seed(seed)
