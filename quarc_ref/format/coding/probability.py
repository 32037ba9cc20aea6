"""One-byte codes of the explicit probabilities of a plane: SPEC 8.2.

A code represents the weight of a 1 in a context, out of 2^24. There are eight codes per
octave towards both ends, so the loss compared with exact probabilities is below one part
in a thousand.
"""

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import PROBABILITY_CODES, WEIGHT_TOTAL
from quarc_ref.format.errors import BadProbabilityError

_HALF = PROBABILITY_CODES // 2
_STEPS_PER_OCTAVE = 8
_MIN_SHIFT = 5


def weight_of_code(code: int) -> int:
    """Return the weight of a 1 for a probability code.

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
        ones: `[n]` numbers of 1 bits.
        counts: `[n]` numbers of bits, at least 1.
    """
    shares = ones * WEIGHT_TOTAL // counts
    codes: Int64 = _ASCENDING[np.searchsorted(_BORDERS, shares, side="right")]
    return codes


def _weight(code: int) -> int:
    if code >= _HALF:
        return WEIGHT_TOTAL - _weight(code - _HALF)
    octave, step = divmod(code, _STEPS_PER_OCTAVE)
    return (_STEPS_PER_OCTAVE + step) << (octave + _MIN_SHIFT)


_WEIGHTS = tuple(_weight(code) for code in range(PROBABILITY_CODES))
_ASCENDING = np.argsort(_WEIGHTS, kind="stable")
_SORTED = np.sort(_WEIGHTS)
_BORDERS = (_SORTED[:-1] + _SORTED[1:] + 1) // 2
