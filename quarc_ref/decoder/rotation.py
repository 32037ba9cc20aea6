"""Computes unit quaternions in Q22 with integer arithmetic: SPEC 7.3.

Components of a unit quaternion are at most 2^22 in magnitude, so all products and sums of
squares, including guard bits, fit in int64.
"""

import numpy as np

from quarc_ref.format.arithmetic import divide_round, isqrt
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import (
    PRODUCT_GUARD_BITS,
    ROTATION_FRACTION_BITS,
    ROTATION_ONE,
    SUM_GUARD_BITS,
)
from quarc_ref.format.errors import DegenerateRotationError, RotationRangeError


def normalize_sums(sums: Int64) -> Int64:
    """Normalize sums of residuals to unit quaternions.

    Args:
        sums: `[4, n]` sums wxyz in rotation steps, below 2^10 in magnitude.

    Returns:
        `[4, n]` unit quaternions, Q22.

    Raises:
        DegenerateRotationError: A sum is zero.
    """
    return _normalize(sums, SUM_GUARD_BITS)


def rotate(rotations: Int32, residuals: Int64) -> Int32:
    """Multiply rotations by residuals on the right, and normalize them (Eq. 2 of the paper).

    Args:
        rotations: `[4, n]` rotations wxyz, Q22.
        residuals: `[4, n]` residuals wxyz, Q22.

    Returns:
        `[4, n]` unit quaternions wxyz, Q22.

    Raises:
        DegenerateRotationError: A product rounds to zero.
    """
    aw, ax, ay, az = rotations.astype(np.int64)
    bw, bx, by, bz = residuals
    product = np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )
    rounded = divide_round(product, ROTATION_ONE)
    return _normalize(rounded, PRODUCT_GUARD_BITS).astype(np.int32)


def expand_rotations(coded: Int64, fraction_bits: int) -> Int32:
    """Decode rotation codes to unit quaternions (SPEC 7.2).

    Args:
        coded: `[4, n]` index of the largest component, then the other three components in order.
        fraction_bits: Fraction bits of these three components.

    Returns:
        `[4, n]` unit quaternions wxyz, Q22.

    Raises:
        RotationRangeError: The norm of the three coded components of a rotation exceeds 1.
    """
    count = coded.shape[1]
    expanded = np.empty((4, count), dtype=np.int32)
    for first in range(0, count, _BLOCK_SIZE):
        block = slice(first, first + _BLOCK_SIZE)
        expanded[:, block] = _expand_block(coded[:, block], fraction_bits)
    return expanded


def _expand_block(coded: Int64, fraction_bits: int) -> Int64:
    unity = 1 << fraction_bits
    components = coded[1:] * (ROTATION_ONE // unity)
    squared_largest = ROTATION_ONE * ROTATION_ONE - (components * components).sum(axis=0)
    if np.any(np.abs(coded[1:]) > unity) or np.any(squared_largest < 0):  # [7.2-5] [7.2-6]
        message = "the norm of three components of a rotation exceeds 1"
        raise RotationRangeError(message)
    # The other components keep their order; after the largest, they move down by one row.
    largest_index, rows = coded[0], np.arange(4)[:, None]
    shifted_components = np.where(
        largest_index < rows, components[[0, 0, 1, 2]], components[[0, 1, 2, 2]]
    )
    return _normalize(
        np.where(largest_index == rows, isqrt(squared_largest), shifted_components),
        PRODUCT_GUARD_BITS,
    )


def _normalize(vectors: Int64, guard_bits: int) -> Int64:
    squared_norms: Int64 = (vectors * vectors).sum(axis=0)
    if np.any(squared_norms == 0):  # [7.3-1]
        message = "a rotation has norm zero"
        raise DegenerateRotationError(message)
    norms = isqrt(squared_norms << (2 * guard_bits))
    return divide_round(vectors * (1 << (ROTATION_FRACTION_BITS + guard_bits)), norms)


_BLOCK_SIZE = 1 << 13  # number of rotations whose intermediate results fit in the cache
