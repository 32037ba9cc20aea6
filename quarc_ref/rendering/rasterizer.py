"""The interface of rasterizers, and the data types that it uses.

Callers apply activations before rendering. Opacities, and thus alpha, are at most 0.99, so
the clamps of the backends have no effect. The backends are `numba` (CPU), `gsplat` (CUDA)
and `torch` (the float64 reference); the module `backends` chooses one.
"""

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.constants_on_device import make_constant
from quarc_ref.rendering.pictures import MAX_OPACITY


@dataclass(frozen=True, slots=True, eq=False)
class Gaussians:
    """Gaussians to render, one row per Gaussian.

    Attributes:
        means: `[N, 3]` centers, world units.
        quaternions: `[N, 4]` quaternions wxyz, which the backend normalizes.
        scales: `[N, 3]` standard deviations, world units.
        opacities: `[N]` opacities from 0 to 0.99.
        sh: `[N, 1, 3]` or `[N, 4, 3]` SH coefficients of red, green and blue.
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
    """A rendered picture, with data for densification.

    Attributes:
        image: `[H, W, 3]` unclamped colors.
        alpha: `[H, W]` 1 minus the remaining transmittance.
        means2d: `[N, 2]` (or `[1, N, 2]`) centers in pixels. The tensor is part of the
            autograd graph, so its gradient is available.
        radii: `[N]` three standard deviations in pixels; 0 for invisible Gaussians.
    """

    image: Tensor
    alpha: Tensor
    means2d: Tensor
    radii: Tensor


class Backdrop(Protocol):
    """Fixed Gaussians in the view of a camera, to which other Gaussians can be added.

    Attributes:
        image: `[H, W, 3]` rendering of the fixed Gaussians.
        alpha: `[H, W]` alpha of the fixed Gaussians.
    """

    image: Tensor
    alpha: Tensor

    def render(self, added: Gaussians) -> Rendering:
        """Render the fixed and the added Gaussians together.

        Args:
            added: Added Gaussians, at least one. In the result, the last rows of `means2d` and
                `radii` belong to the added Gaussians. Only added Gaussians get gradients.
        """
        ...


class Rasterizer(Protocol):
    """Interface of a differentiable renderer.

    Attributes:
        name: Name of the installed package that renders; the metadata of a stream contains its
            version.
    """

    name: str

    def render(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Rendering:
        """Render the view of a camera.

        Args:
            gaussians: Gaussians on the rasterizer's device.
            camera: The camera; Gaussians closer than a fixed fraction of its near-plane distance
                are culled (SPEC 10.3).
            background: `[3]` background color.
        """
        ...

    def render_backdrop(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Backdrop:
        """Render fixed Gaussians, to which other Gaussians can be added; see `render`."""
        ...


class JoinedBackdrop:
    """Backdrop for backends that have no backdrop class; every call renders all Gaussians.

    Args:
        rasterizer: The rasterizer.
        gaussians: Fixed Gaussians.
        camera: The camera.
        background: `[3]` background color.
    """

    def __init__(
        self, rasterizer: Rasterizer, gaussians: Gaussians, camera: Camera, background: Tensor
    ) -> None:
        self._rasterizer, self._gaussians = rasterizer, gaussians
        self._camera, self._background = camera, background
        with torch.no_grad():
            rendering = rasterizer.render(gaussians, camera, background)
        self.image, self.alpha = rendering.image, rendering.alpha

    def render(self, added: Gaussians) -> Rendering:
        """See `Backdrop.render`."""
        tensor_pairs = zip(self._gaussians.tensors(), added.tensors(), strict=True)
        all_gaussians = Gaussians(
            *(
                torch.cat([fixed_tensor.detach(), added_tensor])
                for fixed_tensor, added_tensor in tensor_pairs
            )
        )
        return self._rasterizer.render(all_gaussians, self._camera, self._background)


def activate_opacities(logits: Tensor) -> Tensor:
    """Convert logits to opacities of at most 0.99."""
    return torch.sigmoid(logits).clamp(max=MAX_OPACITY)


def convert_gradient_to_ndc(gradient: Tensor, camera: Camera) -> Tensor:
    """Convert the gradient of `means2d` from pixels to NDC, the unit of 3DGS thresholds."""
    size = (camera.width / 2, camera.height / 2)
    half_size = make_constant(size, gradient.device, gradient.dtype)
    return gradient.reshape(-1, 2) * half_size
