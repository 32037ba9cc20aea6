"""Operations on float quaternions `[4, n]` (wxyz): products, relative rotations, angles, codes."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.rotation import expand_rotations
from quarc_ref.encoder.requantize import code_rotations
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import ROTATION_ONE
from quarc_ref.format.errors import EncodeError

Float64 = NDArray[np.float64]


def normalize(rotations: Float64) -> Float64:
    """Return the quaternions `[4, n]` divided by their norms.

    Raises:
        EncodeError: A quaternion is zero.
    """
    norms = np.sqrt((rotations * rotations).sum(axis=0))
    if not norms.all():
        message = "a rotation is the zero quaternion"
        raise EncodeError(message)
    unit_quaternions: Float64 = rotations / norms
    return unit_quaternions


def conjugate(rotations: Float64) -> Float64:
    """Return the conjugates of quaternions `[4, n]`, which are the inverses of unit quaternions."""
    conjugates: Float64 = rotations * np.array([1.0, -1.0, -1.0, -1.0])[:, None]
    return conjugates


def multiply(first: Float64, second: Float64) -> Float64:
    """Return the Hamilton products of quaternions `[4, n]`; either may be a single column."""
    aw, ax, ay, az = first
    bw, bx, by, bz = second
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def rotations_between(first: Float64, second: Float64) -> Float64:
    """Return the unit quaternions q with w >= 0 for which `first` times q equals `second`."""
    rotation = multiply(conjugate(first), second)
    shortest: Float64 = np.where(rotation[0] < 0, -rotation, rotation)
    return shortest


def angles_between(first: Float64, second: Float64) -> Float64:
    """Return the `[n]` angles between two sets of rotations, radians."""
    rotation = rotations_between(first, second)
    angles: Float64 = 2 * np.arctan2(np.sqrt((rotation[1:] ** 2).sum(axis=0)), rotation[0])
    return angles


def code_quaternions(quaternions: Float64, fraction_bits: int) -> Int64:
    """Return the nearest codes `[4, n]` of unit quaternions; see `requantize.code_rotations`."""
    return code_rotations(np.rint(quaternions * ROTATION_ONE).astype(np.int64), fraction_bits)


def decode_quaternions(codes: Int64, fraction_bits: int) -> Float64:
    """Return the unit quaternions that a decoder makes of codes `[4, n]` (SPEC 7.2).

    Raises:
        RotationRangeError: A code is out of range.
    """
    return expand_rotations(codes, fraction_bits) / ROTATION_ONE
