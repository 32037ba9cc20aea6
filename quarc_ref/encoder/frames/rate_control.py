"""The rate-distortion weight of a frame: quality dial, `--lambda` and rate control.

Rate control depends only on the target and the sizes of the frames written so far, so a
resumed encode continues with the same weights.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.encoder.settings.config import EncoderConfig

# Number of frames over which an accumulated surplus or deficit of bytes is compensated.
_HORIZON = 8
# Weight of the last frame in the model of frame sizes.
_LEARNING = 0.5
# Step from the current factor to the one that the model requires. It is below 1, because
# frame sizes react with a delay, and full steps make them oscillate.
_STRIDE = 0.5
_NEUTRAL_QUALITY = 50.0  # quality at which all weights have the values of the settings
_QUALITY_PER_DOUBLING = 20.0
_MAX_AIM = 2.0
_MAX_LOG_CHANGE = math.log(3)
_MAX_LOG_FACTOR = math.log(256)


@dataclass(frozen=True, slots=True)
class RateDistortion:
    """Factors of the rate-distortion weights of a frame.

    Attributes:
        factor: Factor of all weights: the product of the factors of quality, `--lambda` and
            rate control.
        reference_loss: Mean loss of the training views at decoded frame 0. Weights are
            relative to it, so that the same settings suit easy and hard captures.
    """

    factor: float = 1.0
    reference_loss: float = 1.0

    def absolute(self, weight: float) -> float:
        """Scale a weight that does not depend on the capture."""
        return weight * self.factor

    def relative(self, weight: float) -> float:
        """Scale a weight that is relative to the loss of frame 0."""
        return weight * self.factor * self.reference_loss


def choose_lambda(config: EncoderConfig, sizes: Sequence[int]) -> float:
    """Return the factor of all rate-distortion weights in the next frame.

    Args:
        config: Quality, lambda and target.
        sizes: Bytes of the frames so far, without keyframes.
    """
    factor = config.rd_lambda * quality_factor(config.quality)
    target = config.target_kb_per_frame * 1024
    return factor * control_rate(sizes, target) if target else factor


def quality_factor(quality: float) -> float:
    """Return the factor of all rate-distortion weights for a quality from 0 to 100."""
    return math.exp2((_NEUTRAL_QUALITY - quality) / _QUALITY_PER_DOUBLING)


def control_rate(sizes: Sequence[int], target: float) -> float:
    """Return the factor that brings the mean frame size to a target.

    The model assumes that the size of a frame is a constant divided by the factor, and
    estimates the constant from the frames so far.

    Args:
        sizes: Bytes of every frame so far, each coded with the factor that this function
            returned for the frames before it.
        target: Mean bytes per frame.

    Returns:
        A factor from 1/256 to 256, at most 3 times larger or smaller than for the previous frame.
    """
    factor, constant, spent = 0.0, math.log(target), 0.0
    for done, size in enumerate(sizes, start=1):
        seen = math.log(max(size, 1)) + factor
        constant += (seen - constant) * (1.0 if done == 1 else _LEARNING)
        spent += size
        owed = (done * target - spent) / _HORIZON
        aim = min(max(target + owed, target / _MAX_AIM), target * _MAX_AIM)
        wanted = min(max(constant - math.log(aim), -_MAX_LOG_FACTOR), _MAX_LOG_FACTOR)
        factor += min(max(_STRIDE * (wanted - factor), -_MAX_LOG_CHANGE), _MAX_LOG_CHANGE)
    return math.exp(factor)
