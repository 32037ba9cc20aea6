"""The integer operators of SPEC 4, including all rounding and square roots of the format.

All functions take and return int64. No other code in `format` and `decoder` rounds,
divides possibly negative values, or computes roots.
"""

import numpy as np

from quarc_ref.format.arrays import Int64


def divide_round(numerator: Int64, denominator: Int64 | int) -> Int64:
    """Divide and round to the nearest integer, with halves rounded away from zero (SPEC 4.2).

    Args:
        numerator: Numerators below 2^61 in magnitude.
        denominator: Denominators above 0 and below 2^61; broadcast against `numerator`.

    Returns:
        Rounded quotients in the broadcast shape of the arguments.
    """
    divisor = np.asarray(denominator, dtype=np.int64)
    magnitude: Int64 = (2 * np.abs(numerator) + divisor) // (2 * divisor)
    return np.sign(numerator) * magnitude


def isqrt(values: Int64) -> Int64:
    """Return the square root of each value, rounded down to an integer (SPEC 4.3).

    The floating-point root is an estimate; two integer comparisons correct it.

    Args:
        values: Integers from 0 to 2^62.
    """
    estimate: Int64 = np.sqrt(values.astype(np.float64)).astype(np.int64)
    root: Int64 = estimate - (estimate * estimate > values)
    return root + ((root + 1) * (root + 1) <= values)


def bit_length(values: Int64) -> Int64:
    """Return the number of bits of each value; 0 for 0 (SPEC 4.4).

    Args:
        values: Integers from 0 to 2^62 - 1.
    """
    return np.searchsorted(_POWERS_OF_TWO, values, side="right")


_POWERS_OF_TWO = np.left_shift(np.int64(1), np.arange(62, dtype=np.int64))
