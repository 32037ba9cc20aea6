"""Checks that the GPU and CPU renderers return the same pictures and gradients.

Renders random scenes with gsplat (with numba in a dry run), and compares pictures, alphas and
gradients with those of the numba renderer in float32 and of the torch renderer in float64. A few
pixels can differ where a value is close to a threshold at which a renderer skips a Gaussian or
stops.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from gpu.plan import Sizes
from gpu.rows import Row, RowLog
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.backends import choose_rasterizer
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians, Rasterizer, activate_opacities

_WIDTH, _HEIGHT = 160, 120
_MAX_PICTURE_ERROR = 2e-2
_MAX_RELATIVE_GRADIENT_ERROR = 1e-2
_GAUSSIAN_SIGMA_PIXELS = 1.5  # typical standard deviation in the middle of the scene
_LEAF_NAMES = ("means", "quaternions", "scales", "opacities", "sh")


@dataclass(frozen=True, slots=True)
class _Backend:
    rasterizer: Rasterizer
    device: str
    dtype: torch.dtype


def run(sizes: Sizes, folder: Path, row_log: RowLog) -> None:
    """Compare the device's backend with the reference backends on random scenes."""
    del folder
    device_backend = _Backend(
        choose_rasterizer(torch.device(sizes.device)), sizes.device, torch.float32
    )
    reference_backends = (
        _Backend(NumbaRasterizer(), "cpu", torch.float32),
        _Backend(TorchRasterizer(), "cpu", torch.float64),
    )
    for count in sizes.random_scene_sizes:
        row_log.write_progress(f"{count} Gaussians")
        device_tensors = _render_scene(device_backend, count)
        for reference in reference_backends:
            if reference.rasterizer.name == "torch" and count > 2000:
                continue  # torch would take minutes
            row_log.add(
                _compare(
                    device_tensors,
                    _render_scene(reference, count),
                    (device_backend, reference),
                    count,
                )
            )


def _render_scene(backend: _Backend, count: int) -> dict[str, Tensor]:
    """Render a random scene; return image, alpha and gradients as float64 tensors on the CPU."""
    leaves = [
        leaf.to(backend.device, backend.dtype).requires_grad_() for leaf in _make_scene(count)
    ]
    means, quaternions, scales, logits, sh = leaves
    gaussians = Gaussians(means, quaternions, torch.exp(scales), activate_opacities(logits), sh)
    intrinsics = (0.9 * _WIDTH, 0.9 * _WIDTH, _WIDTH / 2, _HEIGHT / 2)
    pose = ((1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0), (0.0, 0, 0))
    camera = Camera("camera", _WIDTH, _HEIGHT, *intrinsics, *pose, 0.2, False)
    background = torch.tensor([0.1, 0.3, 0.5], device=backend.device, dtype=backend.dtype)
    rendering = backend.rasterizer.render(gaussians, camera, background)
    loss = (rendering.image.square().sum() + rendering.alpha.sum()) / rendering.alpha.numel()
    gradients = dict(zip(_LEAF_NAMES, torch.autograd.grad(loss, leaves), strict=True))
    tensors = {"image": rendering.image, "alpha": rendering.alpha, **gradients}
    return {name: tensor.detach().double().cpu() for name, tensor in tensors.items()}


def _make_scene(count: int) -> list[Tensor]:
    """Return random tensors: means, quaternions, log-scales, opacity logits and SH."""
    generator = torch.Generator().manual_seed(0)

    def sample_normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=generator)

    means = sample_normal(count, 3) * torch.tensor([1.5, 0.9, 0.8]) + torch.tensor([0.0, 0.0, 4.0])
    mean_log_scale = math.log(_GAUSSIAN_SIGMA_PIXELS * 4.0 / _WIDTH)
    return [
        means,
        sample_normal(count, 4),
        sample_normal(count, 3) * 0.4 + mean_log_scale,
        sample_normal(count),
        sample_normal(count, 4, 3) / 4,
    ]


def _compare(
    tensors: dict[str, Tensor],
    reference_tensors: dict[str, Tensor],
    backends: tuple[_Backend, _Backend],
    count: int,
) -> Row:
    figures = {}
    for name, tensor in tensors.items():
        difference = tensor - reference_tensors[name].reshape(tensor.shape)
        figures[f"{name}_max_abs"] = float(difference.abs().max())
        figures[f"{name}_relative"] = float(difference.norm() / reference_tensors[name].norm())
    picture_error = max(figures["image_max_abs"], figures["alpha_max_abs"])
    relative_gradient_error = max(figures[f"{name}_relative"] for name in _LEAF_NAMES)
    gradient_error = max(figures[f"{name}_max_abs"] for name in _LEAF_NAMES)
    first_name, second_name = (f"{backend.rasterizer.name}" for backend in backends)
    return Row(
        "backends",
        f"{first_name} against {second_name}, {count:,} Gaussians",
        f"pictures differ by at most {picture_error:.1e}, gradients by {gradient_error:.1e} "
        f"(relative {relative_gradient_error:.1e})",
        f"at most {_MAX_PICTURE_ERROR:g}; relative {_MAX_RELATIVE_GRADIENT_ERROR:g}",
        picture_error <= _MAX_PICTURE_ERROR
        and relative_gradient_error <= _MAX_RELATIVE_GRADIENT_ERROR,
        figures,
    )
