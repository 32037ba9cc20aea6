"""One-byte codes for the explicit probabilities of a plane: SPEC 8.2.

A code represents the weight of a 1 bit in a context, out of 2^24. The spacing of the weights is
proportional to their distance from the nearer of 0 and 2^24: each halving of this distance is
divided into eight steps. With these codes, coding takes less than 0.1% more bits than with exact
probabilities.
"""

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import PROBABILITY_CODES, WEIGHT_TOTAL
from quarc_ref.format.errors import BadProbabilityError

_CODES_PER_HALF = PROBABILITY_CODES // 2
_STEPS_PER_OCTAVE = 8
_MIN_SHIFT = 5


def weight_of_probability_code(code: int) -> int:
    """Return the weight of a 1 bit (out of 2^24) that a probability code represents.

    Raises:
        BadProbabilityError: The code is 240 or more.
    """
    if code >= PROBABILITY_CODES:  # [8.2-1]
        message = f"probability code {code} is undefined"
        raise BadProbabilityError(message)
    return _WEIGHTS[code]


def choose_codes(ones: Int64, counts: Int64) -> Int64:
    """Return the probability codes nearest to `ones` / `counts`.

    Args:
        ones: `[n]` number of 1 bits in each context.
        counts: `[n]` number of bits in each context, at least 1.
    """
    weights = ones * WEIGHT_TOTAL // counts
    codes: Int64 = _CODES_BY_WEIGHT[np.searchsorted(_CODE_BORDERS, weights, side="right")]
    return codes


def _compute_weight(code: int) -> int:
    if code >= _CODES_PER_HALF:
        return WEIGHT_TOTAL - _compute_weight(code - _CODES_PER_HALF)
    octave, step = divmod(code, _STEPS_PER_OCTAVE)
    return (_STEPS_PER_OCTAVE + step) << (octave + _MIN_SHIFT)


_WEIGHTS = tuple(_compute_weight(code) for code in range(PROBABILITY_CODES))
_CODES_BY_WEIGHT = np.argsort(_WEIGHTS, kind="stable")
_SORTED_WEIGHTS = np.sort(_WEIGHTS)
_CODE_BORDERS = (_SORTED_WEIGHTS[:-1] + _SORTED_WEIGHTS[1:] + 1) // 2
