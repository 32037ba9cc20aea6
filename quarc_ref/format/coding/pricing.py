"""Estimates code lengths, so that a writer can choose whether to write a probability.

Unlike elsewhere in `format`, floats are allowed here: a reader accepts any explicit
probability, so the writer's choice is not normative.
"""

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import CODE_BITS, STATED_WEIGHT, WEIGHT_TOTAL


def saves_bits(zeros: Int64, ones: Int64, context_weights: Int64, fitted_weights: Int64) -> Bits:
    """Find the contexts for which an explicit probability saves more bits than it costs.

    Args:
        zeros: `[n]` number of 0 bits in each context.
        ones: `[n]` number of 1 bits in each context.
        context_weights: `[n]` weights (8.2) of bits that are 1, if no probability is written.
        fitted_weights: `[n]` weights of bits that are 1, if the probability is written.

    Returns:
        `[n]` whether an explicit probability saves bits in each context.
    """
    cost_bits = CODE_BITS + np.log2(WEIGHT_TOTAL / STATED_WEIGHT)
    bits_per_one = np.log2(fitted_weights / context_weights)
    bits_per_zero = np.log2((WEIGHT_TOTAL - fitted_weights) / (WEIGHT_TOTAL - context_weights))
    is_saving: Bits = ones * bits_per_one + zeros * bits_per_zero > cost_bits
    return is_saving
