"""Estimates code lengths, so that a writer can decide when to write a probability explicitly.

Unlike elsewhere in `format`, floats are allowed here: a reader accepts any explicit
probability, so this choice is not normative.
"""

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import CODE_BITS, STATED_WEIGHT, WEIGHT_TOTAL


def saves_bits(zeros: Int64, ones: Int64, known: Int64, fitting: Int64) -> Bits:
    """Find the contexts for which an explicit probability saves more bits than it costs.

    Args:
        zeros: `[n]` number of 0 bits in each context.
        ones: `[n]` number of 1 bits in each context.
        known: `[n]` weights of a 1 if no probability is written.
        fitting: `[n]` weights of a 1 if the probability is written explicitly.

    Returns:
        `[n]` mask of these contexts.
    """
    cost = CODE_BITS + np.log2(WEIGHT_TOTAL / STATED_WEIGHT)
    ratio_of_ones = np.log2(fitting / known)
    ratio_of_zeros = np.log2((WEIGHT_TOTAL - fitting) / (WEIGHT_TOTAL - known))
    saved: Bits = ones * ratio_of_ones + zeros * ratio_of_zeros > cost
    return saved
