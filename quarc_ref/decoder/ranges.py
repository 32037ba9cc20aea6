"""Checks the ranges of the positions and codes of a state: SPEC 7.1."""

from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.constants import CODE_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import CodeRangeError, PositionRangeError


def narrow_positions(positions: Int64) -> Int32:
    """Convert coordinates in lattice units to int32 after checking their range.

    Raises:
        PositionRangeError: A magnitude is above POSITION_LIMIT.
    """
    if _any_beyond(positions, POSITION_LIMIT):  # [4.1-1]
        message = "a Gaussian is off the lattice"
        raise PositionRangeError(message)
    narrow: Int32 = positions.astype("int32")
    return narrow


def narrow_codes(codes: Int64) -> Int16:
    """Convert attribute codes to int16 after checking their range.

    Raises:
        CodeRangeError: A magnitude is above CODE_LIMIT.
    """
    if _any_beyond(codes, CODE_LIMIT):
        message = "an attribute code is out of its range"
        raise CodeRangeError(message)
    narrow: Int16 = codes.astype("int16")
    return narrow


def _any_beyond(numbers: Int64, limit: int) -> bool:
    return bool(numbers.max(initial=0) > limit or numbers.min(initial=0) < -limit)
