"""Estimates the cost of runs of bits, by which a writer chooses between probabilities.

This is not normative, because a reader accepts any stated probability, so floats are
allowed here, unlike elsewhere in `format`.
"""

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import CODE_BITS, STATED_WEIGHT, WEIGHT_TOTAL


def saves_bits(zeros: Int64, ones: Int64, known: Int64, fitting: Int64) -> Bits:
    """Return for which contexts a stated probability saves more bits than it costs.

    Args:
        zeros: `[n]` number of 0 bits in each context.
        ones: `[n]` number of 1 bits in each context.
        known: `[n]` weights of a 1 that follow from the counts.
        fitting: `[n]` weights of a 1 that could be stated.
    """
    cost = CODE_BITS + np.log2(WEIGHT_TOTAL / STATED_WEIGHT)
    ratio_of_ones = np.log2(fitting / known)
    ratio_of_zeros = np.log2((WEIGHT_TOTAL - fitting) / (WEIGHT_TOTAL - known))
    saved: Bits = ones * ratio_of_ones + zeros * ratio_of_zeros > cost
    return saved
