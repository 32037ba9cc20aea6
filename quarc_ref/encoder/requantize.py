"""Rounds a decoded scene to the grid of canonical frames: the inverse of SPEC 7.2.

Rounding uses only integer arithmetic. The error is at most half a `position_step` per axis, and at
most half of 2^-`rotation_bits` in each of the three coded components of a rotation.
"""

import numpy as np

from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arithmetic import divide_round
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import AXIS_BITS_LIMIT, ROTATION_FRACTION_BITS
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Gaussians


def requantize(scene: Scene) -> Gaussians:
    """Return the Gaussians of a scene on the grid of canonical frames, in the same order.

    Raises:
        EncodeError: The scene is wider than a canonical frame can represent (SPEC 5.4).
    """
    header = scene.header
    positions = divide_round(scene.positions.astype(np.int64), header.position_step)
    if int(np.ptp(positions, axis=1).max()) >> AXIS_BITS_LIMIT:
        message = f"the scene is wider than 2^{AXIS_BITS_LIMIT} position steps: use larger steps"
        raise EncodeError(message)
    return Gaussians(
        positions,
        code_rotations(scene.rotations.astype(np.int64), header.rotation_bits),
        scene.codes.astype(np.int64),
    )


def code_rotations(rotations: Int64, fraction_bits: int) -> Int64:
    """Code quaternions `[4, n]` (Q22) as the index of the largest component and the other three.

    The result is `[4, n]`. A quaternion is negated if its largest component is negative.
    """
    count = rotations.shape[1]
    largest_indices = np.argmax(np.abs(rotations), axis=0)
    columns = np.arange(count)
    sign_normalized = rotations * np.sign(rotations[largest_indices, columns])
    is_other = np.arange(4)[:, None] != largest_indices
    smaller_components = sign_normalized.T[is_other.T].reshape(count, 3).T
    coded_components = divide_round(
        smaller_components, 1 << (ROTATION_FRACTION_BITS - fraction_bits)
    )
    return np.concatenate([largest_indices[None], coded_components])
