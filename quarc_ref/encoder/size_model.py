"""The model of a stream's size before its encode, for `encode` and for `doctor`.

The size is the number of Gaussians times the bytes that each of them takes in each kind of frame.
docs/experiments/forecast.md has the measurements.
"""

import math
import operator
from statistics import fmean
from typing import NamedTuple

from quarc_ref.encoder.frames.rate_control import quality_factor
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format import container

# maximum number of Gaussians relative to the initial number, if `prune_rd_lambda` is 0
_MAX_GROWTH_FACTOR = 10
_MIN_SHARE_OF_LIMIT = 1 / 4  # final number of Gaussians, relative to the maximum number
_LAMBDA_EXPONENT = -0.2  # exponent of the weight: half the weight gives 15 % more bytes


class Span(NamedTuple):
    """An expected value between a lower and an upper bound."""

    low: float
    expected: float
    high: float


# bytes per Gaussian of canonical frames and snapshots
_BYTES_PER_GAUSSIAN = {container.CANO: Span(7, 8, 11), container.SNAP: Span(2, 2.5, 4)}
# the same for other frames, if births must be worth their bytes (`births.rd_lambda`) or not
_FRAME_BYTES_WITH_RD, _FRAME_BYTES_WITHOUT_RD = Span(0.05, 0.25, 0.4), Span(0.05, 1.0, 1.5)
# The number of Gaussians is multiplied by these powers of the share that a subject covers.
_SUBJECT_EXPONENTS = Span(0.5, 0.4, 0.25)


def measure_subject_share(views: TrainingViews) -> float:
    """Return which share of the pixels of frame 0 the subject covers; 1 if pictures are opaque."""
    alphas = (views.alpha(view, 0) for view in views.used_at(0))
    return fmean(1.0 if alpha is None else float(alpha.mean()) for alpha in alphas)


def estimate_gaussians(
    point_count: int, settings: CanonicalSettings, subject_share: float = 1.0
) -> Span:
    """Estimate the number of Gaussians of frame 0.

    Densification increases the initial number towards a limit, and pruning reduces it. Nothing
    is drawn around a subject, and the last pruning leaves fewer Gaussians if it is small.

    Args:
        point_count: Number of initial points.
        settings: Settings of frame 0.
        subject_share: Share of the pixels that the subject covers; 1 for the number of Gaussians
            in training, before the last pruning.
    """
    limit = settings.max_gaussians
    initial_count = min(point_count, settings.initial_gaussians, limit)
    if not settings.prune_rd_lambda:
        limit = min(limit, initial_count * _MAX_GROWTH_FACTOR)
    expected = math.sqrt(initial_count * limit)
    counts = Span(min(_MIN_SHARE_OF_LIMIT * limit, expected), expected, limit)
    scales = (math.pow(subject_share, exponent) for exponent in _SUBJECT_EXPONENTS)
    return Span(*map(operator.mul, counts, scales))


def estimate_stream_bytes(gaussians: Span, config: EncoderConfig, frame_count: int) -> Span:
    """Estimate the size of a stream of `frame_count` frames in bytes."""
    byte_factor = math.pow(config.rd_lambda * quality_factor(config.quality), _LAMBDA_EXPONENT)
    kinds = config.canonical.count_frame_kinds(frame_count)
    frame_bytes = _FRAME_BYTES_WITH_RD if config.births.rd_lambda else _FRAME_BYTES_WITHOUT_RD
    target = config.target_kb_per_frame * 1024

    def estimate(bound: int) -> float:
        coded_bytes = {kind: span[bound] for kind, span in _BYTES_PER_GAUSSIAN.items()}
        keyframes = sum(kinds[kind] * coded_bytes[kind] for kind in coded_bytes)
        scaled_count = gaussians[bound] * byte_factor
        later_frame = target or scaled_count * frame_bytes[bound]
        return scaled_count * keyframes + kinds[container.FRAM] * later_frame

    return Span(*map(estimate, range(len(gaussians))))
