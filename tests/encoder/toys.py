"""A toy capture: a few small Gaussians that move in front of a wall of large Gaussians."""

import math

import numpy as np
import torch

from quarc_ref.datasets.capture import Capture, Points
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.frames import BirthSettings, MotionSettings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.rendering.raster_numba import NumbaRasterizer

WIDTH, HEIGHT = 48, 36
_DISTANCE = 3.0
_SH_C0 = 0.28209479177387814

SMALL = EncoderConfig(
    stream=StreamHeader(gaussians_per_anchor=4, resample_interval=2),
    canonical=CanonicalSettings(
        iterations=100, max_gaussians=160, sh_from_iter=20, densify_from_iter=20,
        densify_until_iter=50, densification_interval=10, position_noise=0.0,
    ),
    motion=MotionSettings(
        iterations=20, lr=5e-3, level_lr_factor=2.0, lr_end_factor=0.05, rate_model="group_log",
        rd_lambda=0.0005, warm_start="projection", momentum=1.0,
    ),
    births=BirthSettings(
        iterations=6, split_iters=(3,), max_births=8, grad_threshold=1e-6, max_parent_scale=1.0
    ),
)  # fmt: skip


def make_cameras(count: int = 4) -> list[Camera]:
    """Return cameras on an arc that look at the origin; the first camera is held out."""
    cameras = []
    for index in range(count):
        angle = 0.5 * (index - (count - 1) / 2)
        c, s = math.cos(angle), math.sin(angle)
        rotation = (c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
        intrinsics = (50.0, 50.0, WIDTH / 2, HEIGHT / 2)
        translation = (0.0, 0.0, _DISTANCE)
        name = f"cam{index:02}"
        cameras.append(
            Camera(name, WIDTH, HEIGHT, *intrinsics, rotation, translation, 0.5, index == 0)
        )
    return cameras


def make_splats(frame: int, blob_count: int = 40) -> Splats:
    """Return the scene: a wall of large Gaussians, and small Gaussians that move sideways."""
    rng = np.random.default_rng(3)
    wall = np.stack(np.meshgrid(np.linspace(-2, 2, 9), np.linspace(-1.5, 1.5, 7), [1.0]), -1)
    wall = wall.reshape(-1, 3)
    blobs = rng.uniform(-0.6, 0.6, (blob_count, 3)) + np.array([0.05 * frame, 0, 0])
    positions = np.concatenate([wall, blobs]).astype(np.float32)
    count = len(positions)
    sizes = np.where(np.arange(count) < len(wall), 0.35, 0.1)
    sh = rng.normal(0, 1.0, (count, 1, 3)).astype(np.float32)
    return Splats(
        positions,
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (count, 1)),
        np.log(np.tile(sizes[:, None], (1, 3))).astype(np.float32),
        np.full(count, 3.0, dtype=np.float32),
        sh,
    )


class _RenderedSource:
    def __init__(self, cameras: list[Camera]) -> None:
        self._cameras = cameras

    def read(self, camera: int, frame: int) -> np.ndarray:
        picture = render_picture(make_splats(frame), self._cameras[camera])
        return np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)


def make_capture(frame_count: int = 4) -> Capture:
    cameras = make_cameras()
    splats = make_splats(0)
    noise = np.random.default_rng(0).normal(0, 0.01, splats.positions.shape)
    colors = np.clip(0.5 + _SH_C0 * splats.sh[:, 0], 0, 1) * 255
    points = Points(splats.positions + noise.astype(np.float32), colors.astype(np.uint8))
    return Capture("toy", cameras, frame_count, 30.0, points, _RenderedSource(cameras), "0" * 64)


def make_context(seed: int = 0) -> TrainingContext:
    views = TrainingViews(make_capture(), torch.device("cpu"))
    exposures = Exposures(len(views.cameras), torch.device("cpu"))
    return TrainingContext(views, NumbaRasterizer(), seed, exposures)
