"""The one-byte probability codes of a section's table: SPEC 8.2.

A code stands for the weight of a 1 in its context, out of 2^24. Codes are
spaced evenly in octaves towards both ends, eight to an octave, so that the
loss against exact probabilities is below one part in a thousand.
"""

import numpy as np

from quarc_ref.format.constants import PROBABILITY_CODES, WEIGHT_TOTAL
from quarc_ref.format.errors import BadProbabilityError

_HALF = PROBABILITY_CODES // 2
_STEPS_PER_OCTAVE = 8
_LEAST_SHIFT = 5


def weight_of_code(code: int) -> int:
    """Return the weight of a 1 under a probability code.

    Raises:
        BadProbabilityError: The code is 240 or more.
    """
    if code >= PROBABILITY_CODES:
        message = f"probability code {code} is undefined"
        raise BadProbabilityError(message)
    return _WEIGHTS[code]


def choose_code(ones: int, count: int) -> int:
    """Return the code nearest to `ones` of `count` bits being 1.

    Args:
        ones: From 0 to `count`.
        count: At least 1.
    """
    share = ones * WEIGHT_TOTAL // count
    return int(_ASCENDING[np.searchsorted(_BORDERS, share, side="right")])


def _weight(code: int) -> int:
    if code >= _HALF:
        return WEIGHT_TOTAL - _weight(code - _HALF)
    octave, step = divmod(code, _STEPS_PER_OCTAVE)
    return (_STEPS_PER_OCTAVE + step) << (octave + _LEAST_SHIFT)


_WEIGHTS = tuple(_weight(code) for code in range(PROBABILITY_CODES))
_ASCENDING = np.argsort(_WEIGHTS, kind="stable")
_SORTED = np.sort(_WEIGHTS)
_BORDERS = (_SORTED[:-1] + _SORTED[1:] + 1) // 2
