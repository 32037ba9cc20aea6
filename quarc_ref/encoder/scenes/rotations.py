"""Quaternions in floats, `[4, n]` wxyz: normalization, relative rotations and angles."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.errors import EncodeError

Float64 = NDArray[np.float64]


def normalize(rotations: Float64) -> Float64:
    """Return unit quaternions.

    Raises:
        EncodeError: A quaternion is zero.
    """
    lengths = np.sqrt((rotations * rotations).sum(axis=0))
    if not lengths.all():
        message = "a rotation is the zero quaternion"
        raise EncodeError(message)
    unit: Float64 = rotations / lengths
    return unit


def rotations_between(before: Float64, after: Float64) -> Float64:
    """Return the unit quaternions q with w >= 0 for which `before` q is `after`."""
    aw, ax, ay, az = before[0], -before[1], -before[2], -before[3]
    bw, bx, by, bz = after
    turn = np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )
    near: Float64 = np.where(turn[0] < 0, -turn, turn)
    return near


def angles_between(first: Float64, second: Float64) -> Float64:
    """Return `[n]` the angles between rotations, radians."""
    turn = rotations_between(first, second)
    angles: Float64 = 2 * np.arctan2(np.sqrt((turn[1:] ** 2).sum(axis=0)), turn[0])
    return angles
