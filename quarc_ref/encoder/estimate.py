"""Estimates the time of an encode and the size of its stream before it starts.

A few steps of frame 0 are timed on this machine and extrapolated. Sizes are extrapolated
from the captures in benchmarks/, with an error of up to a factor of two or three.
"""

import math
import time

import torch

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.frames.rate_control import quality_factor
from quarc_ref.encoder.monitoring.forecast import frame_seconds
from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.canonical import canonical_learning_rates, initialize_from_points
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Trainer

_WARM_STEPS, _TIMED_STEPS = 2, 4
_HALF_RESOLUTION = 0.4  # relative to the time of a step
_BYTES_OF_GAUSSIAN = 7.0
_BYTES_OF_MOVED, _BYTES_OF_UNPRICED = 0.25, 1.0  # bytes per Gaussian and frame
# relative to the number of initial Gaussians, without their rate-distortion weight
_MAX_GROWTH = 10
_BYTES_PER_LAMBDA = -0.2  # exponent: half the weight gives 15 % more bytes


def estimate_encode(
    context: TrainingContext, points: Points, plan: EncodePlan, config: EncoderConfig
) -> Estimate:
    """Estimate time and size of an encode, without side effects on random numbers or training.

    Args:
        context: Views and renderer.
        points: Initial points.
        plan: The remaining work.
        config: All settings.
    """
    step = time_step(context, points, config)
    canonical = config.canonical
    halved = min(canonical.half_resolution_until_iter, canonical.iterations)
    first = step * (canonical.iterations - halved * (1 - _HALF_RESOLUTION))
    frames = plan.frames - max(1, plan.first_frame)
    seconds = frames * frame_seconds(plan, step) + (first if plan.first_frame == 0 else 0.0)
    _, expected = _guess_gaussians(len(points.positions), canonical)
    return Estimate(seconds, _guess_bytes(expected, plan, config))


def time_step(context: TrainingContext, points: Points, config: EncoderConfig) -> float:
    """Return the mean duration of a training step of frame 0, seconds.

    Some steps on the initial Gaussians are timed; there are more Gaussians later.

    Args:
        context: Views and renderer.
        points: Initial points.
        config: All settings.
    """
    initial, expected = _guess_gaussians(len(points.positions), config.canonical)
    generator = torch.Generator().manual_seed(0)
    start = initialize_from_points(points, config.canonical, generator, context.device)
    trainer = Trainer(start, canonical_learning_rates(config.canonical, context.views.extent))
    times = []
    for step in range(_WARM_STEPS + _TIMED_STEPS):
        started = time.perf_counter()
        view = step % len(context.views.cameras)
        rendering = context.render(trainer.attributes.activated(), view)
        loss = context.photometric_loss(rendering.image, view, 0, config.canonical.lambda_dssim)
        trainer.step(loss, rendering.means2d)
        if context.device.type == "cuda":
            torch.cuda.synchronize(context.device)
        times.append(time.perf_counter() - started)
    return sorted(times[_WARM_STEPS:])[_TIMED_STEPS // 2] * expected / initial


def _guess_gaussians(point_count: int, settings: CanonicalSettings) -> tuple[int, float]:
    """Return the initial number of Gaussians, and an estimate of the final one.

    Densification increases the number towards `max_gaussians`, and pruning reduces it.
    """
    initial = min(point_count, settings.initial_gaussians, settings.max_gaussians)
    limit = settings.max_gaussians if settings.prune_rd_lambda else _most_grown(initial, settings)
    return initial, math.sqrt(initial * limit)


def _most_grown(initial: int, settings: CanonicalSettings) -> int:
    return min(settings.max_gaussians, initial * _MAX_GROWTH)


def _guess_bytes(gaussians: float, plan: EncodePlan, config: EncoderConfig) -> float:
    """Estimate the size of a stream with the given number of Gaussians."""
    price = math.pow(config.rd_lambda * quality_factor(config.quality), _BYTES_PER_LAMBDA)
    per_gaussian = _BYTES_OF_MOVED if config.births.rd_lambda else _BYTES_OF_UNPRICED
    per_frame = config.target_kb_per_frame * 1024 or gaussians * per_gaussian * price
    return gaussians * _BYTES_OF_GAUSSIAN * price + (plan.frames - 1) * per_frame
