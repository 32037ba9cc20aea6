"""Cost of runs of bits, by which a writer chooses between probabilities.

Not normative: a reader accepts any probability that a plane states, so that here,
unlike elsewhere in `format`, a float does no harm.
"""

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import CODE_BITS, STATED_WEIGHT, WEIGHT_TOTAL


def is_worth_stating(zeros: Int64, ones: Int64, known: Int64, fitting: Int64) -> Bits:
    """Return for which contexts a stated probability saves more bits than it costs.

    Args:
        zeros: `[n]` how many bits of each context are 0.
        ones: `[n]` how many are 1.
        known: `[n]` weights of a 1 that need not be stated.
        fitting: `[n]` weights of the codes that could be.
    """
    cost = CODE_BITS + np.log2(WEIGHT_TOTAL / STATED_WEIGHT)
    ratio_of_ones = np.log2(fitting / known)
    ratio_of_zeros = np.log2((WEIGHT_TOTAL - fitting) / (WEIGHT_TOTAL - known))
    saved: Bits = ones * ratio_of_ones + zeros * ratio_of_zeros > cost
    return saved
