"""Trains frame 0 with all its iterations; measures the time and the PSNR on training views."""

from pathlib import Path
from statistics import mean

import torch

from gpu.plan import Sizes
from gpu.rows import Row, RowLog
from gpu.scene import load_capture
from gpu.training import describe_memory, make_config, train
from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder import Scene, dequantize
from quarc_ref.encoder.checks.first_frame_check import measure_views
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.rendering.backends import choose_rasterizer
from quarc_ref.streams import decode


def run(sizes: Sizes, folder: Path, row_log: RowLog) -> None:
    """Train frame 0, decode it, and compare it with the pictures of the training views."""
    config = make_config(
        {"canonical.iterations": sizes.canonical_iterations, "canonical.ensemble_size": 1}
    )
    training = train(sizes, folder, row_log, config, frames=1)
    (scene,) = decode(training.stream)
    seconds = training.timer.stage_timer.seconds["canonical"]
    figures = {"seconds": seconds, "gaussians": float(scene.count)}
    description = (
        f"frame 0: {sizes.canonical_iterations:,} iterations, {scene.count:,} Gaussians at the end"
    )
    row_log.add(Row("frame 0", description, f"{seconds:.1f} s", figures=figures))
    psnr = _measure_psnr(sizes, load_capture(sizes, folder), scene)
    result = f"{psnr:.2f} dB, exposure-corrected"
    row_log.add(Row("frame 0", "PSNR on training views", result, figures={"psnr": psnr}))
    row_log.add(describe_memory("frame 0", sizes))


def _measure_psnr(sizes: Sizes, capture: Capture, scene: Scene) -> float:
    device = torch.device(sizes.device)
    rasterizer, background = choose_rasterizer(device), torch.zeros(3, device=device)
    gaussians = from_splats(dequantize(scene), device).activated()
    views = []
    for index, camera in enumerate(capture.cameras):
        with torch.no_grad():
            image = rasterizer.render(gaussians, camera, background).image
        picture = torch.from_numpy(capture.image(index, 0).copy()).to(device) / 255
        views += measure_views([camera.name], [(image, picture)], [None])
    return mean(view.psnr for view in views)
