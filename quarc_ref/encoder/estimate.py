"""Estimates the time of an encode and the size of the stream before the encode starts.

The time is extrapolated from a few training steps of frame 0 on this machine. The size is the one
that `size_model` expects, and can be wrong by a factor of up to three.
"""

import time

import torch

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.monitoring.forecast import HALF_RESOLUTION_COST, estimate_frame_seconds
from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.size_model import (
    estimate_gaussians,
    estimate_stream_bytes,
    measure_subject_share,
)
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.initialization import initialize_from_points
from quarc_ref.encoder.training.learning_rates import canonical_learning_rates
from quarc_ref.encoder.training.trainable import Trainer

_WARM_UP_STEPS, _TIMED_STEPS = 2, 4
# Duration of a step on a pseudo-view, whose picture the ensemble renders, relative to a step at
# half resolution.
_PSEUDO_VIEW_STEPS = 2


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
    share = measure_subject_share(context.views)
    gaussians = estimate_gaussians(len(points.positions), config.canonical, share)
    return Estimate(seconds, estimate_stream_bytes(gaussians, config, plan.frames).expected)


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
    expected number of Gaussians in training.

    Args:
        context: Training views and renderer.
        points: Initial points.
        config: All settings.
    """
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
    training_count = estimate_gaussians(len(points.positions), config.canonical).expected
    growth = training_count / len(attributes.means)
    return growth * sorted(durations[_WARM_UP_STEPS:])[_TIMED_STEPS // 2]
