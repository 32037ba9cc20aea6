"""Compares the speed of the numba rasterizer with that of the pure torch rasterizer on the CPU.

    python benchmarks/raster.py [--gaussians N] [--width W] [--height H] [--json]

Both rasterizers run the forward and backward pass for the same random scene and camera. The torch
rasterizer runs in float32, as in training. Random Gaussians overlap more than those of a trained
scene, so only the ratio of the times is meaningful.
"""

import argparse
import json
import math
import time
from statistics import median

import torch

from options import parse_positive
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians, Rasterizer, activate_opacities

_GAUSSIAN_SIGMA_PIXELS = 1.5  # typical standard deviation in the middle of the scene


def make_scene(count: int, width: int) -> list[torch.Tensor]:
    """Return random tensors: means, quaternions, log-scales, opacity logits and SH."""
    generator = torch.Generator().manual_seed(0)

    def sample_normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator)

    means = sample_normal(count, 3) * torch.tensor([1.5, 0.9, 0.8]) + torch.tensor([0.0, 0.0, 4.0])
    mean_log_scale = math.log(_GAUSSIAN_SIGMA_PIXELS * 4.0 / width)
    leaves = [
        means,
        sample_normal(count, 4),
        sample_normal(count, 3) * 0.4 + mean_log_scale,
        sample_normal(count),
        sample_normal(count, 4, 3) / 4,
    ]
    return [leaf.requires_grad_() for leaf in leaves]


def time_rasterizer(
    rasterizer: Rasterizer, leaves: list[torch.Tensor], camera: Camera, repeats: int
) -> dict[str, float]:
    """Return the median times of the forward and the backward pass in milliseconds."""
    background = torch.zeros(3)
    forward_times, backward_times = [], []

    def compute_loss() -> torch.Tensor:
        means, quaternions, log_scales, opacity_logits, sh = leaves
        opacities = activate_opacities(opacity_logits)
        gaussians = Gaussians(means, quaternions, torch.exp(log_scales), opacities, sh)
        return rasterizer.render(gaussians, camera, background).image.square().sum()

    for _ in range(repeats + 1):
        start = time.perf_counter()
        loss = compute_loss()
        forward_end = time.perf_counter()
        torch.autograd.grad(loss, leaves)
        forward_times.append(forward_end - start)
        backward_times.append(time.perf_counter() - forward_end)
    # The first repetition includes compiling, so it is not counted.
    return {
        "forward_ms": 1e3 * median(forward_times[1:]),
        "backward_ms": 1e3 * median(backward_times[1:]),
    }


def main() -> None:
    """Time both rasterizers, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--gaussians", type=parse_positive, default=40_000)
    parser.add_argument("--width", type=parse_positive, default=400)
    parser.add_argument("--height", type=parse_positive, default=224)
    parser.add_argument("--repeats", type=parse_positive, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    width, height = arguments.width, arguments.height
    intrinsics = (0.9 * width, 0.9 * width, width / 2, height / 2)
    camera = Camera(
        "camera", width, height, *intrinsics, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0), 0.2, False
    )
    leaves = make_scene(arguments.gaussians, width)
    rows = {
        "numba": time_rasterizer(NumbaRasterizer(), leaves, camera, arguments.repeats),
        "torch": time_rasterizer(TorchRasterizer(), leaves, camera, 1),
    }
    totals = {name: sum(row.values()) for name, row in rows.items()}
    ratio = totals["torch"] / totals["numba"]
    if arguments.json:
        print(json.dumps({**rows, "ratio": ratio}, indent=2))
        return
    for name, row in rows.items():
        print(f"{name}: {row['forward_ms']:.1f} ms forward, {row['backward_ms']:.1f} ms backward")
    print(f"numba is {ratio:.1f} times as fast as torch")


if __name__ == "__main__":
    main()
