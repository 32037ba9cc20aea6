"""Compares the CPU rasterizer with pure torch: forward and backward, in one run.

    python benchmarks/raster.py [--gaussians N] [--width W] [--height H] [--json]

Both backends render the same random scene from the same camera; the pure torch reference runs in
float32 here, as for training. Random Gaussians overlap more than those of a trained scene: the
ratio matters, not the milliseconds.
"""

import argparse
import json
import math
import time
from statistics import median

import torch

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians, Rasterizer, activate_opacities

_PIXELS_PER_GAUSSIAN = 1.5  # standard deviation in the middle of the scene


def make_scene(count: int, width: int) -> list[torch.Tensor]:
    """Return leaves: means, quaternions, scales, logits, SH."""
    generator = torch.Generator().manual_seed(0)

    def draw(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator)

    means = draw(count, 3) * torch.tensor([1.5, 0.9, 0.8]) + torch.tensor([0.0, 0.0, 4.0])
    size = math.log(_PIXELS_PER_GAUSSIAN * 4.0 / width)
    parts = [means, draw(count, 4), draw(count, 3) * 0.4 + size, draw(count), draw(count, 4, 3) / 4]
    return [part.requires_grad_() for part in parts]


def time_rasterizer(
    rasterizer: Rasterizer, leaves: list[torch.Tensor], camera: Camera, repeats: int
) -> dict[str, float]:
    """Return the median milliseconds of forward and backward."""
    background = torch.zeros(3)
    forward, backward = [], []

    def draw() -> torch.Tensor:
        means, quaternions, scales, logits, sh = leaves
        opacities = activate_opacities(logits)
        gaussians = Gaussians(means, quaternions, torch.exp(scales), opacities, sh)
        return rasterizer.render(gaussians, camera, background).image.square().sum()

    for _ in range(repeats + 1):
        started = time.perf_counter()
        loss = draw()
        drawn = time.perf_counter()
        torch.autograd.grad(loss, leaves)
        forward.append(drawn - started)
        backward.append(time.perf_counter() - drawn)
    # The first round compiles.
    return {"forward_ms": 1e3 * median(forward[1:]), "backward_ms": 1e3 * median(backward[1:])}


def main() -> None:
    """Time both backends."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--gaussians", type=int, default=40_000)
    parser.add_argument("--width", type=int, default=400)
    parser.add_argument("--height", type=int, default=224)
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    width, height = arguments.width, arguments.height
    lens = (0.9 * width, 0.9 * width, width / 2, height / 2)
    camera = Camera(
        "camera", width, height, *lens, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0), 0.2, False
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
    print(f"numba is {ratio:.1f} times as fast")


if __name__ == "__main__":
    main()
