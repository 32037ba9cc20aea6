"""Rounds a decoded scene to the grid of canonical frames: the inverse of SPEC 7.2.

Rounding uses only integer arithmetic. The error is at most half a `position_step` per axis, and at
most half of 2^-`rotation_bits` in each of the three coded components of a rotation.
"""

import numpy as np

from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arithmetic import divide_round
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import AXIS_BITS_LIMIT, ROTATION_FRACTION_BITS
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Gaussians


def requantize(scene: Scene) -> Gaussians:
    """Return the Gaussians of a scene on the grid of canonical frames, in the same order."""
    header = scene.header
    return Gaussians(
        divide_round(scene.positions.astype(np.int64), header.position_step),
        code_rotations(scene.rotations.astype(np.int64), header.rotation_bits),
        scene.codes.astype(np.int64),
    )


def find_representable(positions: Int64) -> Bits:
    """Return a mask `[n]` of the positions `[3, n]` that a canonical frame can represent.

    They must fit into a box of 2^20 position steps along each axis (SPEC 5.4). If they do not,
    because Gaussians have moved or were added at a distance, those in the box around the median are
    kept.

    Raises:
        EncodeError: No position remains.
    """
    if int(np.ptp(positions, axis=1).max()) < 1 << AXIS_BITS_LIMIT:
        return np.ones(positions.shape[1], dtype=np.bool_)
    medians = np.sort(positions, axis=1)[:, (positions.shape[1] - 1) // 2]
    offsets = np.abs(positions - medians[:, None])
    is_inside: Bits = (offsets < 1 << (AXIS_BITS_LIMIT - 1)).all(axis=0)
    if not is_inside.any():
        message = (
            f"the scene is wider than 2^{AXIS_BITS_LIMIT} position steps: increase "
            "steps.position_pixels, or stream.position_step if steps.position_pixels is 0"
        )
        raise EncodeError(message)
    return is_inside


def select_gaussians(gaussians: Gaussians, mask: Bits) -> Gaussians:
    """Return the Gaussians of a mask `[n]`."""
    return Gaussians(
        gaussians.positions[:, mask], gaussians.rotations[:, mask], gaussians.codes[:, mask]
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
