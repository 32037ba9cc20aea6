"""How dear bytes are, frame by frame, so that a stream meets its target (`--target-kb-per-frame`).

All that it goes by is the target and the sizes of the frames written so far,
so that a later encoder can go on from the file alone.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from quarc_ref.encoder.settings.config import EncoderConfig

# What the frames so far have spent too much or too little is made up for in so many frames.
_HORIZON = 8
# Share of the way from the model of bytes so far to what the last frame says.
_LEARNING = 0.5
# Share of the way from a frame's factor to the one that the model asks for: what a frame
# was not told, the next has to tell, so that a factor that jumps makes sizes that swing.
_STRIDE = 0.5
# At the first of these every price is what the settings say; so much more quality halves it.
_USUAL_QUALITY = 50.0
_QUALITY_PER_DOUBLING = 20.0
_MOST_AIM = 2.0
_MOST_TURN = math.log(3)
_MOST_WEIGHT = math.log(256)


def price_bytes(
    config: EncoderConfig, sizes: Sequence[int], reference_loss: float = 1.0
) -> EncoderConfig:
    """Return the settings of the next frame, with every price on bytes multiplied.

    Args:
        config: Of the stream.
        sizes: Bytes of the chunks of all frames since the first, canonical ones left out.
        reference_loss: Mean loss of the training views when frame 0 is decoded: what prices
            are shares of, so that the same ones suit captures that are easy and hard.
    """
    target = config.target_kb_per_frame * 1024
    weight = config.rd_lambda * weigh_quality(config.quality)
    if target:
        weight *= control_rate(sizes, target)
    canonical, motion = config.canonical, config.motion
    in_shares = 1.0 if motion.rate_model == "l1" else reference_loss  # the paper's is of no capture
    return replace(
        config,
        canonical=replace(
            canonical,
            prune_rd_lambda=canonical.prune_rd_lambda * weight,
            code_rd_lambda=canonical.code_rd_lambda * weight,
        ),
        motion=replace(motion, rd_lambda=motion.rd_lambda * weight * in_shares),
        updates=replace(
            config.updates,
            rd_lambda=config.updates.rd_lambda * weight * reference_loss,
            min_gain=config.updates.min_gain * weight * reference_loss,
        ),
        births=replace(config.births, rd_lambda=config.births.rd_lambda * weight * reference_loss),
    )


def weigh_quality(quality: float) -> float:
    """Return the factor of every price on bytes at a point of the quality dial (`--quality`)."""
    return math.exp2((_USUAL_QUALITY - quality) / _QUALITY_PER_DOUBLING)


def control_rate(sizes: Sequence[int], target: float) -> float:
    """Return the factor of every price in the next frame.

    A frame's bytes are taken to be inverse to the factor, up to a constant
    that is learned on the way.

    Args:
        sizes: Bytes of every frame so far, each coded under the factor that
            this function gave for those before it.
        target: Bytes that a frame is to have, in the mean.

    Returns:
        Within 1/256 to 256.
    """
    factor, constant, spent = 0.0, math.log(target), 0.0
    for done, size in enumerate(sizes, start=1):
        seen = math.log(max(size, 1)) + factor
        constant += (seen - constant) * (1.0 if done == 1 else _LEARNING)
        spent += size
        owed = (done * target - spent) / _HORIZON
        aim = min(max(target + owed, target / _MOST_AIM), target * _MOST_AIM)
        wanted = min(max(constant - math.log(aim), -_MOST_WEIGHT), _MOST_WEIGHT)
        factor += min(max(_STRIDE * (wanted - factor), -_MOST_TURN), _MOST_TURN)
    return math.exp(factor)
