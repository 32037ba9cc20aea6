"""Computes the rate-distortion weight of a frame from `--quality`, `--lambda` and rate control.

Rate control depends only on the target and the sizes of the previous frames, so a resumed
encode continues with the same weights.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.encoder.settings.config import EncoderConfig

# Number of frames in which rate control compensates an accumulated surplus or deficit of bytes.
_COMPENSATION_FRAMES = 8
# Weight of the last frame in the model of frame sizes.
_MODEL_UPDATE_WEIGHT = 0.5
# Fraction of the change that the model requires, applied per frame. It is below 1, because
# frame sizes react with a delay and would oscillate after full changes.
_DAMPING_FACTOR = 0.5
_NEUTRAL_QUALITY = 50.0  # the quality at which weights are used without scaling
_QUALITY_PER_DOUBLING = 20.0
_MAX_TARGET_RATIO = 2.0
_MAX_LOG_CHANGE = math.log(3)
_MAX_LOG_FACTOR = math.log(256)


@dataclass(frozen=True, slots=True)
class RateDistortion:
    """Factors by which the rate-distortion weights of a frame are multiplied.

    Attributes:
        factor: Product of the factors from quality, `--lambda` and rate control.
        reference_loss: Mean loss of decoded frame 0 over the training views. Weights that are
            relative to the loss are multiplied by `reference_loss`, so that the same settings suit
            easy and hard captures.
    """

    factor: float = 1.0
    reference_loss: float = 1.0

    def scale_absolute(self, weight: float) -> float:
        """Return a weight multiplied by the factor, but not by the loss of frame 0."""
        return weight * self.factor

    def scale_relative(self, weight: float) -> float:
        """Return a weight multiplied by the factor and the loss of frame 0."""
        return weight * self.factor * self.reference_loss


def choose_rd_factor(config: EncoderConfig, frame_sizes: Sequence[int]) -> float:
    """Return the factor by which all rate-distortion weights of the next frame are multiplied.

    Args:
        config: All settings, including quality, lambda and target size.
        frame_sizes: Sizes of the previous frames that are not keyframes, bytes.
    """
    factor = config.rd_lambda * quality_factor(config.quality)
    target = config.target_kb_per_frame * 1024
    return factor * control_rate(frame_sizes, target) if target else factor


def quality_factor(quality: float) -> float:
    """Return the factor by which a quality (0 to 100) multiplies all rate-distortion weights."""
    return math.exp2((_NEUTRAL_QUALITY - quality) / _QUALITY_PER_DOUBLING)


def control_rate(frame_sizes: Sequence[int], target: float) -> float:
    """Return the factor for the next frame that brings the mean frame size closer to a target.

    The model assumes that the size of a frame is a constant divided by the factor, and
    estimates the constant from the previous frames.

    Args:
        frame_sizes: Sizes of all previous frames, bytes. Each frame must have been coded with the
            factor that this function returned for the sizes of the frames before it.
        target: Desired mean frame size, bytes.

    Returns:
        A factor from 1/256 to 256, which is at least a third of the factor of the previous frame
        and at most three times as large.
    """
    log_factor, log_constant, total_bytes = 0.0, math.log(target), 0.0
    for frame_count, size in enumerate(frame_sizes, start=1):
        frame_log_constant = math.log(max(size, 1)) + log_factor
        log_constant += (frame_log_constant - log_constant) * (
            1.0 if frame_count == 1 else _MODEL_UPDATE_WEIGHT
        )
        total_bytes += size
        correction = (frame_count * target - total_bytes) / _COMPENSATION_FRAMES
        frame_target = min(
            max(target + correction, target / _MAX_TARGET_RATIO), target * _MAX_TARGET_RATIO
        )
        goal_log_factor = min(
            max(log_constant - math.log(frame_target), -_MAX_LOG_FACTOR), _MAX_LOG_FACTOR
        )
        log_factor += min(
            max(_DAMPING_FACTOR * (goal_log_factor - log_factor), -_MAX_LOG_CHANGE), _MAX_LOG_CHANGE
        )
    return math.exp(log_factor)
