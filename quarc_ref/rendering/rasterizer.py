"""The interface of a rasterizer, and its data.

Activations are applied here, before every backend, so that the clamps of the backends have no
effect: alpha is held at 0.99 by the opacity. Backends are `numba` (CPU), `gsplat` (CUDA) and
`torch` (the float64 reference); `backends` chooses.
"""

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pictures import OPACITY_MOST


@dataclass(frozen=True, slots=True, eq=False)
class Gaussians:
    """Gaussians to render, one row per Gaussian.

    Attributes:
        means: `[N, 3]` world units.
        quaternions: `[N, 4]` wxyz; normalized by the backend.
        scales: `[N, 3]` standard deviations, world units.
        opacities: `[N]` 0 to 0.99.
        sh: `[N, 4, 3]` coefficient, then red, green, blue.
    """

    means: Tensor
    quaternions: Tensor
    scales: Tensor
    opacities: Tensor
    sh: Tensor

    def tensors(self) -> tuple[Tensor, ...]:
        """Return the tensors in the order of the attributes."""
        return (self.means, self.quaternions, self.scales, self.opacities, self.sh)


@dataclass(frozen=True, slots=True, eq=False)
class Rendering:
    """A picture and the data that densification needs.

    Attributes:
        image: `[H, W, 3]` not clamped.
        alpha: `[H, W]` 1 less the transmittance left.
        means2d: `[N, 2]` (or `[1, N, 2]`) pixels; in the graph of image and
            alpha, so that its gradient can be asked for.
        radii: `[N]` three standard deviations in pixels; 0 where not drawn.
    """

    image: Tensor
    alpha: Tensor
    means2d: Tensor
    radii: Tensor


class Backdrop(Protocol):
    """Gaussians that do not change, as one camera sees them.

    Attributes:
        image: `[H, W, 3]` of them alone.
        alpha: `[H, W]` of them alone.
    """

    image: Tensor
    alpha: Tensor

    def render(self, added: Gaussians) -> Rendering:
        """Draw them and others together.

        Args:
            added: At least one. They are the last rows of the rendering's
                `means2d` and `radii`, and gradients go to them alone.
        """
        ...


class Rasterizer(Protocol):
    """Draws Gaussians differentiably."""

    name: str

    def render(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Rendering:
        """Draw what a camera sees.

        Args:
            gaussians: On the rasterizer's device.
            camera: The camera; Gaussians nearer than its near bound are culled (SPEC 10.3).
            background: `[3]` color behind everything.
        """
        ...

    def render_backdrop(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Backdrop:
        """Draw Gaussians to which others will be added; arguments as for `render`."""
        ...


class JoinedBackdrop:
    """A backdrop for backends without their own: everything is redrawn.

    Args:
        rasterizer: The rasterizer that draws.
        gaussians: Gaussians that do not change.
        camera: The camera that sees them.
        background: `[3]` color behind everything.
    """

    def __init__(
        self, rasterizer: Rasterizer, gaussians: Gaussians, camera: Camera, background: Tensor
    ) -> None:
        self._rasterizer, self._gaussians = rasterizer, gaussians
        self._camera, self._background = camera, background
        with torch.no_grad():
            alone = rasterizer.render(gaussians, camera, background)
        self.image, self.alpha = alone.image, alone.alpha

    def render(self, added: Gaussians) -> Rendering:
        """See `Backdrop.render`."""
        pairs = zip(self._gaussians.tensors(), added.tensors(), strict=True)
        joined = Gaussians(*(torch.cat([fixed.detach(), more]) for fixed, more in pairs))
        return self._rasterizer.render(joined, self._camera, self._background)


def activate_opacities(logits: Tensor) -> Tensor:
    """Return opacities of logits, at most 0.99."""
    return torch.sigmoid(logits).clamp(max=OPACITY_MOST)


def to_ndc(gradient: Tensor, camera: Camera) -> Tensor:
    """Return `[N, 2]` a gradient with respect to `means2d` in NDC, the unit of thresholds."""
    half = gradient.new_tensor([camera.width / 2, camera.height / 2])
    return gradient.reshape(-1, 2) * half
