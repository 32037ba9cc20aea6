"""Morton keys, which order canonical Gaussians (SPEC 8.5) and group Gaussians by cell (6.3).

Bit b of x, y and z becomes bit 3b + 2, 3b + 1 and 3b of the key, respectively, so the points of
a cell of size 2^s have consecutive keys.
"""

import numpy as np

from quarc_ref.format.arrays import Int64

# Each step splits every group of bits into two halves and shifts the upper half.
_SHIFTS = (32, 16, 8, 4, 2)
_MASKS = (
    0x1FFFFF,
    0x1F00000000FFFF,
    0x1F0000FF0000FF,
    0x100F00F00F00F00F,
    0x10C30C30C30C30C3,
    0x1249249249249249,
)


def interleave(points: Int64) -> Int64:
    """Return the Morton key of each point.

    Args:
        points: `[3, n]` coordinates xyz from 0 to 2^21 - 1.

    Returns:
        `[n]` keys below 2^63.
    """
    spread_bits = points
    for shift, mask in zip(_SHIFTS, _MASKS[1:], strict=True):
        spread_bits = (spread_bits | (spread_bits << shift)) & mask
    keys: Int64 = (spread_bits[0] << 2) | (spread_bits[1] << 1) | spread_bits[2]
    return keys


def deinterleave(keys: Int64) -> Int64:
    """Return the points `[3, n]` of Morton keys `[n]`."""
    coordinates = np.stack([keys >> 2, keys >> 1, keys]) & _MASKS[-1]
    for shift, mask in zip(_SHIFTS[::-1], _MASKS[-2::-1], strict=True):
        coordinates = (coordinates | (coordinates >> shift)) & mask
    return coordinates
