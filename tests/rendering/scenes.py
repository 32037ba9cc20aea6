"""Small random scenes for renderers, and the gradients of a renderer."""

import math

import torch

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Gaussians, activate_opacities

NAMES = ("means", "quaternions", "log_scales", "logits", "sh")


def make_camera(width: int, height: int, near: float = 0.2) -> Camera:
    """A rotated and moved camera whose principal point is off the center."""
    c, s = math.cos(0.3), math.sin(0.3)
    rotation = (c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
    lens = (0.9 * width, 0.95 * width, width / 2 + 1.5, height / 2 - 2)
    return Camera("camera", width, height, *lens, rotation, (0.1, -0.2, 0.3), near, False)


def make_leaves(count: int, dtype: torch.dtype, seed: int = 0) -> dict[str, torch.Tensor]:
    """Raw attributes of Gaussians in front of the camera, some of them outside the picture."""
    generator = torch.Generator().manual_seed(seed)

    def draw(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    leaves = {
        "means": draw(count, 3) * torch.tensor([1.5, 1.0, 1.0]) + torch.tensor([-1.0, 0.0, 4.0]),
        "quaternions": draw(count, 4),
        "log_scales": draw(count, 3) * 0.5 - 2,
        "logits": draw(count) * 1.5,
        "sh": draw(count, 4, 3) * 0.4,
    }
    return {name: leaf.to(dtype).requires_grad_() for name, leaf in leaves.items()}


def activate(leaves: dict[str, torch.Tensor]) -> Gaussians:
    return Gaussians(
        leaves["means"],
        leaves["quaternions"],
        torch.exp(leaves["log_scales"]),
        activate_opacities(leaves["logits"]),
        leaves["sh"],
    )


def weighted_sum(rendering, seed: int = 5) -> torch.Tensor:
    """A scalar in which every number of image and alpha has its own weight."""
    generator = torch.Generator().manual_seed(seed)
    total = rendering.image.new_zeros(())
    for part in (rendering.image, rendering.alpha):
        weights = torch.randn(part.shape, generator=generator, dtype=torch.float64)
        total = total + (part * weights.to(part)).sum()
    return total


def render_with_gradients(rasterizer, leaves, camera):
    """The rendering, and the gradients of its weighted sum for means2d and every leaf."""
    background = torch.tensor([0.2, 0.5, 0.1]).to(leaves["means"])
    rendering = rasterizer.render(activate(leaves), camera, background)
    gradients = torch.autograd.grad(weighted_sum(rendering), [rendering.means2d, *leaves.values()])
    return rendering, dict(zip(("means2d", *NAMES), gradients, strict=True))
