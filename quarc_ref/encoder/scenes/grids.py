"""Detects quantization steps in values, so that they need not be quantized again."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT

# tolerance relative to a step: larger than binary32 errors of numbers below 2^13 steps
_OFF_GRID = 1e-3
_MAX_VALUES = 1 << 16
_NEARLY_ALL = 0.98


def find_step(values: NDArray[np.floating], least: float) -> float | None:
    """Return the step of which all numbers are multiples, or None.

    Args:
        values: Numbers, in an array of any shape.
        least: The smallest step of interest.
    """
    distinct = np.unique(np.abs(values.astype(np.float64)))
    if distinct.size > _MAX_VALUES:
        return None
    gaps = np.diff(np.concatenate([[0.0], distinct]))
    gaps = gaps[gaps > least / 2]
    if not gaps.size:
        return None
    rough = float(gaps.min())
    multiples = np.rint(distinct / rough)
    if not multiples[-1] or rough < least:
        return None
    # the largest number gives the most accurate estimate
    step = float(distinct[-1] / multiples[-1])
    is_grid = np.abs(distinct / step - np.rint(distinct / step)).max() < _OFF_GRID
    return step if is_grid else None


def find_lattice(positions: list[NDArray[np.floating]], most: float) -> int | None:
    """Return the smallest k such that all coordinates are multiples of 2^-k, or None.

    Args:
        positions: Arrays of coordinates, world units.
        most: The largest allowed multiple.
    """
    reach = max(float(np.abs(array).max()) for array in positions)
    for exponent in range(LATTICE_EXPONENT_LIMIT + 1):
        if reach * 2.0**exponent > most:
            return None
        scaled = [array.astype(np.float64) * 2.0**exponent for array in positions]
        if all(np.array_equal(array, np.rint(array)) for array in scaled):
            return exponent
    return None


def greatest_divisor(numbers: NDArray[np.floating]) -> int:
    """Return the greatest common divisor of whole numbers; 0 if all are 0."""
    return int(np.gcd.reduce(np.rint(numbers).astype(np.int64), axis=None, initial=0))


def usual_divisor(numbers: NDArray[np.floating], most: int) -> int:
    """Return the largest integer of which nearly all numbers are multiples.

    Args:
        numbers: Integers; zeros are ignored.
        most: Largest divisor to consider.

    Returns:
        The divisor; 1 if there is none, or if all numbers are 0.
    """
    whole = np.abs(np.rint(numbers).astype(np.int64))
    whole = whole[whole > 0]
    if not whole.size:
        return 1
    fitting = (step for step in range(most, 1, -1) if np.mean(whole % step == 0) > _NEARLY_ALL)
    return next(fitting, 1)
