"""Detects the steps of quantized values, so that these values can be coded without loss."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT

# Deviation from a multiple, relative to the step. It exceeds the rounding errors of binary32
# for numbers below 2^13 steps.
_GRID_TOLERANCE = 1e-3
_MAX_VALUES = 1 << 16
_MIN_MULTIPLE_FRACTION = 0.98


def find_step(values: NDArray[np.floating], min_step: float) -> float | None:
    """Return the smallest gap between values, including 0, if all values are multiples of it.

    The result is None if they are not. It is measured at the largest value, which is most accurate.

    Args:
        values: Values in an array of any shape.
        min_step: Smallest step that is detected.
    """
    distinct_values = np.unique(np.abs(values.astype(np.float64)))
    if distinct_values.size > _MAX_VALUES:
        return None
    gaps = np.diff(np.concatenate([[0.0], distinct_values]))
    gaps = gaps[gaps > min_step / 2]
    if not gaps.size:
        return None
    rough_step = float(gaps.min())
    multiples = np.rint(distinct_values / rough_step)
    if not multiples[-1] or rough_step < min_step:
        return None
    step = float(distinct_values[-1] / multiples[-1])
    quotients = distinct_values / step
    is_on_grid = np.abs(quotients - np.rint(quotients)).max() < _GRID_TOLERANCE
    return step if is_on_grid else None


def find_lattice(positions: list[NDArray[np.floating]], max_multiple: float) -> int | None:
    """Return the smallest k such that all coordinates are multiples of 2^-k, or None.

    Args:
        positions: Arrays of coordinates, world units.
        max_multiple: Largest allowed magnitude of a coordinate, in units of 2^-k.
    """
    max_coordinate = max(float(np.abs(array).max()) for array in positions)
    for exponent in range(LATTICE_EXPONENT_LIMIT + 1):
        if max_coordinate * 2.0**exponent > max_multiple:
            return None
        scaled_positions = [array.astype(np.float64) * 2.0**exponent for array in positions]
        if all(np.array_equal(array, np.rint(array)) for array in scaled_positions):
            return exponent
    return None


def greatest_common_divisor(numbers: NDArray[np.floating]) -> int:
    """Return the greatest common divisor of integers stored as floats; 0 if all are 0."""
    return int(np.gcd.reduce(np.rint(numbers).astype(np.int64), axis=None, initial=0))


def find_common_divisor(numbers: NDArray[np.floating], max_divisor: int) -> int:
    """Return the largest number that divides more than 98 % of the numbers.

    Args:
        numbers: Integers stored as floats; zeros are ignored.
        max_divisor: Largest divisor to consider.

    Returns:
        The divisor; 1 if no larger divisor exists, or if all numbers are 0.
    """
    integers = np.abs(np.rint(numbers).astype(np.int64))
    integers, counts = np.unique(integers[integers > 0], return_counts=True)
    if not integers.size:
        return 1
    min_count = counts.sum() * _MIN_MULTIPLE_FRACTION
    # All multiples of a divisor are at least as large as the divisor.
    counts_from_here_up = counts[::-1].cumsum()[::-1]
    max_divisor = min(max_divisor, int(integers[counts_from_here_up > min_count].max()))
    divisors = (
        divisor
        for divisor in range(max_divisor, 1, -1)
        if counts[integers % divisor == 0].sum() > min_count
    )
    return next(divisors, 1)
