"""Checks that the device's backend agrees with the others on pictures and gradients.

Compares pictures, alphas and gradients of random scenes: gsplat (numba in a dry run), numba in
float32, and the float64 reference in torch. Single pixels can differ where one backend stops or
skips at a threshold and another narrowly does not.
"""

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from gpu.plan import Sizes
from gpu.rows import Notebook, Row
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.backends import choose_rasterizer
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians, Rasterizer, activate_opacities
from raster import make_scene

_WIDTH, _HEIGHT = 160, 120
_MAX_ABSOLUTE = 2e-2
_MAX_RELATIVE = 1e-2
_NAMES = ("means", "quaternions", "scales", "opacities", "sh")


@dataclass(frozen=True, slots=True)
class _Backend:
    rasterizer: Rasterizer
    device: str
    kind: torch.dtype


def work(sizes: Sizes, folder: Path, notebook: Notebook) -> None:
    """Compare the backends on every scene."""
    del folder
    drawn = _Backend(choose_rasterizer(torch.device(sizes.device)), sizes.device, torch.float32)
    others = (
        _Backend(NumbaRasterizer(), "cpu", torch.float32),
        _Backend(TorchRasterizer(), "cpu", torch.float64),
    )
    for count in sizes.random:
        notebook.note(f"{count} Gaussians")
        ours = _draw(drawn, count)
        for other in others:
            if other.rasterizer.name == "torch" and count > 2000:
                continue  # torch would take minutes
            notebook.add(_compare(ours, _draw(other, count), (drawn, other), count))


def _draw(backend: _Backend, count: int) -> dict[str, Tensor]:
    """Return image, alpha and gradients of a random scene, on the CPU in float64."""
    leaves = [
        leaf.detach().to(backend.device, backend.kind).requires_grad_()
        for leaf in make_scene(count, _WIDTH)
    ]
    means, quaternions, scales, logits, sh = leaves
    gaussians = Gaussians(means, quaternions, torch.exp(scales), activate_opacities(logits), sh)
    lens = (0.9 * _WIDTH, 0.9 * _WIDTH, _WIDTH / 2, _HEIGHT / 2)
    pose = ((1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0), (0.0, 0, 0))
    camera = Camera("camera", _WIDTH, _HEIGHT, *lens, *pose, 0.2, False)
    background = torch.tensor([0.1, 0.3, 0.5], device=backend.device, dtype=backend.kind)
    drawn = backend.rasterizer.render(gaussians, camera, background)
    loss = (drawn.image.square().sum() + drawn.alpha.sum()) / drawn.alpha.numel()
    gradients = dict(zip(_NAMES, torch.autograd.grad(loss, leaves), strict=True))
    parts = {"image": drawn.image, "alpha": drawn.alpha, **gradients}
    return {name: part.detach().double().cpu() for name, part in parts.items()}


def _compare(
    ours: dict[str, Tensor],
    theirs: dict[str, Tensor],
    backends: tuple[_Backend, _Backend],
    count: int,
) -> Row:
    figures = {}
    for name, part in ours.items():
        difference = part - theirs[name].reshape(part.shape)
        figures[f"{name}_max_abs"] = float(difference.abs().max())
        figures[f"{name}_relative"] = float(difference.norm() / theirs[name].norm())
    shown = max(figures["image_max_abs"], figures["alpha_max_abs"])
    sloped = max(figures[f"{name}_relative"] for name in _NAMES)
    steepest = max(figures[f"{name}_max_abs"] for name in _NAMES)
    first, second = (f"{each.rasterizer.name}" for each in backends)
    return Row(
        "backends",
        f"{first} against {second}, {count:,} Gaussians",
        f"pictures differ by {shown:.1e}, gradients by {steepest:.1e} (relative {sloped:.1e})",
        f"at most {_MAX_ABSOLUTE:g}; relative {_MAX_RELATIVE:g}",
        shown <= _MAX_ABSOLUTE and sloped <= _MAX_RELATIVE,
        figures,
    )
