"""Small random scenes for tests of renderers, and gradients of a renderer."""

import math

import torch

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Gaussians, activate_opacities

NAMES = ("means", "quaternions", "log_scales", "logits", "sh")


def make_camera(width: int, height: int, near: float = 0.2) -> Camera:
    """Return a rotated and translated camera whose principal point is not at the center."""
    cosine, sine = math.cos(0.3), math.sin(0.3)
    rotation = (cosine, 0.0, sine, 0.0, 1.0, 0.0, -sine, 0.0, cosine)
    lens = (0.9 * width, 0.95 * width, width / 2 + 1.5, height / 2 - 2)
    return Camera("camera", width, height, *lens, rotation, (0.1, -0.2, 0.3), near, False)


def make_leaves(count: int, dtype: torch.dtype, seed: int = 0) -> dict[str, torch.Tensor]:
    """Return attributes before activation; some Gaussians are outside the camera's picture."""
    generator = torch.Generator().manual_seed(seed)

    def draw_normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    leaves = {
        "means": draw_normal(count, 3) * torch.tensor([1.5, 1.0, 1.0])
        + torch.tensor([-1.0, 0.0, 4.0]),
        "quaternions": draw_normal(count, 4),
        "log_scales": draw_normal(count, 3) * 0.5 - 2,
        "logits": draw_normal(count) * 1.5,
        "sh": draw_normal(count, 4, 3) * 0.4,
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


def compute_weighted_sum(rendering, seed: int = 5) -> torch.Tensor:
    """Return a sum in which every number of image and alpha has a different weight."""
    generator = torch.Generator().manual_seed(seed)
    total = rendering.image.new_zeros(())
    for output in (rendering.image, rendering.alpha):
        weights = torch.randn(output.shape, generator=generator, dtype=torch.float64)
        total = total + (output * weights.to(output)).sum()
    return total


def render_with_gradients(rasterizer, leaves, camera):
    """Return a rendering, and the gradients of its weighted sum for means2d and every leaf."""
    background = torch.tensor([0.2, 0.5, 0.1]).to(leaves["means"])
    rendering = rasterizer.render(activate(leaves), camera, background)
    gradients = torch.autograd.grad(
        compute_weighted_sum(rendering), [rendering.means2d, *leaves.values()]
    )
    return rendering, dict(zip(("means2d", *NAMES), gradients, strict=True))
