"""Estimates the time of an encode and the size of the stream before the encode starts.

The time is extrapolated from a few training steps of frame 0 on this machine. The size is
extrapolated from measurements of the captures in benchmarks/, and can be wrong by a factor of up
to three.
"""

import math
import time

import torch

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.frames.rate_control import quality_factor
from quarc_ref.encoder.monitoring.forecast import HALF_RESOLUTION_COST, estimate_frame_seconds
from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.initialization import initialize_from_points
from quarc_ref.encoder.training.learning_rates import canonical_learning_rates
from quarc_ref.encoder.training.trainable import Trainer
from quarc_ref.format import container

_WARM_UP_STEPS, _TIMED_STEPS = 2, 4
# Duration of a step on a pseudo-view, whose picture the ensemble renders, relative to a step at
# half resolution.
_PSEUDO_VIEW_STEPS = 2
_CANONICAL_BYTES_PER_GAUSSIAN, _SNAPSHOT_BYTES_PER_GAUSSIAN = 8.0, 2.5
_FRAME_BYTES_WITH_RD, _FRAME_BYTES_WITHOUT_RD = 0.25, 1.0  # bytes per Gaussian and frame
# maximum number of Gaussians relative to the initial number, if `prune_rd_lambda` is 0
_MAX_GROWTH_FACTOR = 10
_LAMBDA_EXPONENT = -0.2  # exponent of the weight: half the weight gives 15 % more bytes


def estimate_encode(
    context: TrainingContext, points: Points, plan: EncodePlan, config: EncoderConfig
) -> Estimate:
    """Estimate the remaining time and the total size without affecting the random numbers.

    Args:
        context: Training views and renderer.
        points: Initial points.
        plan: The remaining work of the encode.
        config: All settings.
    """
    step_seconds = estimate_step_seconds(context, points, config)
    full_steps, half_steps = count_steps(config.canonical)
    first_frame_seconds = step_seconds * (full_steps + HALF_RESOLUTION_COST * half_steps)
    later_frame_count = plan.frames - max(1, plan.first_frame)
    seconds = later_frame_count * estimate_frame_seconds(plan, step_seconds) + (
        first_frame_seconds if plan.first_frame == 0 else 0.0
    )
    _, expected_gaussian_count = _estimate_gaussians(len(points.positions), config.canonical)
    return Estimate(seconds, _estimate_bytes(expected_gaussian_count, plan, config))


def count_steps(canonical: CanonicalSettings) -> tuple[int, int]:
    """Return how many training steps frame 0 has at full resolution and at half resolution.

    A step on a pseudo-view counts as several steps at half resolution, because it takes longer.
    """
    half_steps = canonical.half_resolution_steps
    pseudo_view_steps = _PSEUDO_VIEW_STEPS * canonical.pseudo_view_count
    return canonical.training_steps - half_steps, half_steps + pseudo_view_steps


def estimate_step_seconds(context: TrainingContext, points: Points, config: EncoderConfig) -> float:
    """Estimate the mean duration of a training step of frame 0, in seconds.

    A few steps with the initial Gaussians are timed, and their median duration is scaled to the
    expected number of Gaussians.

    Args:
        context: Training views and renderer.
        points: Initial points.
        config: All settings.
    """
    initial_gaussian_count, expected_gaussian_count = _estimate_gaussians(
        len(points.positions), config.canonical
    )
    generator = torch.Generator().manual_seed(0)
    attributes = initialize_from_points(points, config.canonical, generator, context.device)
    trainer = Trainer(attributes, canonical_learning_rates(config.canonical, context.views.extent))
    durations = []
    for step in range(_WARM_UP_STEPS + _TIMED_STEPS):
        start_time = time.perf_counter()
        view = step % len(context.views.cameras)
        rendering = context.render(trainer.attributes.activated(), view)
        loss = context.photometric_loss(rendering.image, view, 0, config.canonical.lambda_dssim)
        trainer.step(loss, rendering.means2d)
        if context.device.type == "cuda":
            torch.cuda.synchronize(context.device)
        durations.append(time.perf_counter() - start_time)
    return (
        sorted(durations[_WARM_UP_STEPS:])[_TIMED_STEPS // 2]
        * expected_gaussian_count
        / initial_gaussian_count
    )


def _estimate_gaussians(point_count: int, settings: CanonicalSettings) -> tuple[int, float]:
    """Return the initial number of Gaussians, and an estimate of the final number.

    Densification increases the number towards `max_gaussians`, and pruning reduces it.
    """
    initial_count = min(point_count, settings.initial_gaussians, settings.max_gaussians)
    max_final_count = (
        settings.max_gaussians
        if settings.prune_rd_lambda
        else _limit_final_count(initial_count, settings)
    )
    return initial_count, math.sqrt(initial_count * max_final_count)


def _limit_final_count(initial_count: int, settings: CanonicalSettings) -> int:
    return min(settings.max_gaussians, initial_count * _MAX_GROWTH_FACTOR)


def _estimate_bytes(gaussian_count: float, plan: EncodePlan, config: EncoderConfig) -> float:
    """Estimate the size of a stream in bytes from the number of Gaussians."""
    byte_factor = math.pow(config.rd_lambda * quality_factor(config.quality), _LAMBDA_EXPONENT)
    bytes_per_gaussian = (
        _FRAME_BYTES_WITH_RD if config.births.rd_lambda else _FRAME_BYTES_WITHOUT_RD
    )
    bytes_per_frame = (
        config.target_kb_per_frame * 1024 or gaussian_count * bytes_per_gaussian * byte_factor
    )
    kinds = config.canonical.count_frame_kinds(plan.frames)
    keyframe_bytes_per_gaussian = (
        kinds[container.CANO] * _CANONICAL_BYTES_PER_GAUSSIAN
        + kinds[container.SNAP] * _SNAPSHOT_BYTES_PER_GAUSSIAN
    )
    return (
        gaussian_count * keyframe_bytes_per_gaussian * byte_factor
        + kinds[container.FRAM] * bytes_per_frame
    )
