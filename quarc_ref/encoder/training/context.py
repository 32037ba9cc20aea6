"""The objects that all training stages share: views, renderer and random numbers.

Random numbers depend only on (seed, frame, purpose), so that the training of any frame can
be repeated from the decoded state of the previous frame.
"""

import hashlib
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.monitoring.monitor import Monitor, NullMonitor, TrainingStep
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.backends import choose_device, choose_rasterizer
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, Rasterizer, Rendering

_MAX_EXPOSURE_PIXELS = 10_000  # about; the sorting of more would take long


@dataclass(frozen=True, slots=True)
class Observers:
    """Callbacks that observe training without affecting its result.

    Attributes:
        progress: Called after every training step.
        monitor: Called for every training step on a training view, and for every frame.
    """

    progress: Progress = field(default_factory=NullProgress)
    monitor: Monitor = field(default_factory=NullMonitor)


@dataclass(frozen=True, slots=True, eq=False)
class TrainingContext:
    """The training views of a capture, and the renderer for them.

    Attributes:
        views: The training views.
        rasterizer: Renderer on the device of the views.
        seed: Seed of all random numbers.
        exposures: Exposure gains of the training views.
        observers: Callbacks that report the progress of training.
    """

    views: TrainingViews
    rasterizer: Rasterizer
    seed: int
    exposures: Exposures
    observers: Observers = field(default_factory=Observers)

    @property
    def device(self) -> torch.device:
        """Device that holds the pictures and trained tensors."""
        return self.views.device

    def halved(self) -> "TrainingContext":
        """Return a context whose pictures have half the width and height."""
        return replace(self, views=self.views.halved())

    @property
    def view_count(self) -> int:
        """Number of training views."""
        return len(self.views.cameras)

    def camera(self, view: int) -> Camera:
        """Return the camera of a view."""
        return self.views.cameras[view]

    def render(self, gaussians: Gaussians, view: int) -> Rendering:
        """Render a view with the background of its pictures, which is black if they are opaque."""
        return self.rasterizer.render(gaussians, self.camera(view), self.background(view))

    def render_backdrop(self, gaussians: Gaussians, view: int) -> Backdrop:
        """Render a view as a backdrop, to which new Gaussians can be added later."""
        return self.rasterizer.render_backdrop(gaussians, self.camera(view), self.background(view))

    def background(self, view: int) -> Tensor:
        """Return the `[3]` exposure-corrected background color of a view."""
        return self.views.background(view) * self.exposures.white(view)

    def report_step(  # noqa: PLR0913, a training step has six properties
        self,
        stage: str,
        step_numbers: tuple[int, int, int],
        view: int,
        gaussian_count: int,
        image: Tensor,
        loss: Tensor,
    ) -> None:
        """Report a training step to the monitor.

        Args:
            stage: Name of the stage, as in `TrainingStep`.
            step_numbers: Index of the frame, index of the step (from 1), and number of steps of
                the stage.
            view: Index of the rendered view.
            gaussian_count: Number of rendered Gaussians.
            image: `[H, W, 3]` rendering.
            loss: Loss, a scalar tensor.
        """
        frame, step, step_count = step_numbers

        def get_truth() -> Tensor:
            return self.truth(view, frame)

        mask = self.views.mask(view, frame)
        self.observers.monitor.step(
            TrainingStep(
                stage, frame, step, step_count, gaussian_count, loss, image, get_truth, mask
            )
        )

    def truth(self, view: int, frame: int) -> Tensor:
        """Return the exposure-corrected `TrainingViews.picture` `[H, W, 3]` of a view."""
        return self.exposures.correct(self.views.picture(view, frame), view)

    def previous_truth(self, view: int, frame: int) -> Tensor:
        """Return `truth` of the frame before a frame, with the exposure of that frame before."""
        return self.views.picture(view, frame - 1) / self.exposures.previous_gains[view]

    def apply_mask(self, image: Tensor, view: int, frame: int) -> Tensor:
        """Set the masked pixels of a rendered view `[H, W, 3]` to black.

        Renderings must be masked before a comparison with `truth`, so that masked pixels have
        no error and no gradient. If the view has no mask, `image` itself is returned.
        """
        mask = self.views.mask(view, frame)
        return image if mask is None else image * mask

    def exposure_pair(
        self, rendering: Rendering, background: Tensor, view: int, frame: int
    ) -> tuple[Tensor, Tensor]:
        """Return the rendering and the picture from which exposures are estimated.

        They are `[H, W, 3]`, and masked pixels are black. If the background is transparent, they
        are `[P, 3]` pixels that the subject covers in the picture, on black. Other pixels do not
        count: in a camera that the subject leaves, they would be most of the rendering.

        Args:
            rendering: Rendering of the view.
            background: `[3]` background color of the rendering.
            view: Index of the view.
            frame: Ordinal of the frame.
        """
        image, picture = rendering.image, self.views.picture(view, frame)
        alpha = self.views.alpha(view, frame)
        if alpha is None:
            return self.apply_mask(image, view, frame), picture
        image = image - (1 - rendering.alpha[..., None]) * background
        picture = picture - (1 - alpha) * self.views.background(view)
        is_covered = alpha[..., 0] > 0
        stride = max(1, int(is_covered.sum()) // _MAX_EXPOSURE_PIXELS)
        return image[is_covered][::stride], picture[is_covered][::stride]

    def photometric_loss(self, image: Tensor, view: int, frame: int, lambda_dssim: float) -> Tensor:
        """Return the loss of a rendering compared with the picture of its view.

        Masked pixels do not contribute to the loss.

        Args:
            image: `[H, W, 3]` rendering.
            view: Index of the view.
            frame: Ordinal of the frame.
            lambda_dssim: Weight of D-SSIM in the loss.
        """
        return photometric_loss(
            self.apply_mask(image, view, frame), self.truth(view, frame), lambda_dssim
        )

    def generator(self, frame: int, purpose: str) -> torch.Generator:
        """Return a CPU random generator, seeded by the encode's seed, the frame and the purpose."""
        key = f"{self.seed}/{frame}/{purpose}".encode()
        seed = int.from_bytes(hashlib.sha256(key).digest()[:8], "little") >> 1
        return torch.Generator().manual_seed(seed)


def make_context(
    capture: Capture,
    device_name: str,
    seed: int,
    observers: Observers = Observers(),
    downscale: int = 1,
) -> TrainingContext:
    """Return the context for training on a capture.

    Args:
        capture: Capture; its held-out cameras are not used.
        device_name: Name of the device, as in `choose_device`.
        seed: Seed of all random numbers.
        observers: Callbacks that report the progress of training.
        downscale: Factor by which width and height of the pictures are reduced.

    Raises:
        DownscaleError: The downscaled pictures would have no pixels.
        RuntimeError: There is no rasterizer for the device.
    """
    device = choose_device(device_name)
    views = TrainingViews(capture, device, downscale)
    exposures = Exposures(len(views.cameras), device)
    return TrainingContext(views, choose_rasterizer(device), seed, exposures, observers)
