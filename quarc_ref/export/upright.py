"""Rotates frames to +y up, for formats that define their axes: SPEC Annex C.2.

The rotation maps axes to axes, so positions and SH are only permuted and negated, without
rounding; quaternions are rounded.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Float32, Splats
from quarc_ref.export.clip import Clip

_HALF = 0.5**0.5
# Quaternions wxyz that rotate each up axis to +y.
_TURNS = {
    "+x": (_HALF, 0.0, 0.0, _HALF),
    "-x": (_HALF, 0.0, 0.0, -_HALF),
    "+y": (1.0, 0.0, 0.0, 0.0),
    "-y": (0.0, 1.0, 0.0, 0.0),
    "+z": (_HALF, -_HALF, 0.0, 0.0),
    "-z": (_HALF, _HALF, 0.0, 0.0),
}
_OPPOSITE = {"+z": "-z", "-z": "+z"}


def rotate_upright(splats: Splats, clip: Clip) -> Splats:
    """Rotate splats to a right-handed frame with +y up.

    If the stream does not declare its up axis, -y is assumed.

    Args:
        splats: Splats in the frame of the stream.
        clip: Properties of the stream, which define the frame.
    """
    if not clip.header.right_handed:
        splats = _negate_z(splats)
    turn = find_turn(clip)
    matrix = matrix_of(turn)
    return replace(
        splats,
        positions=_apply(matrix, splats.positions),
        rotations=multiply(np.array(turn), splats.rotations),
        sh=turn_harmonics(matrix, splats.sh),
    )


def find_turn(clip: Clip) -> tuple[float, float, float, float]:
    """Return the quaternion wxyz that rotates the right-handed frame of a stream to +y up."""
    up = clip.up if clip.header.right_handed else _OPPOSITE.get(clip.up, clip.up)
    return _TURNS[up]


def matrix_of(turn: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Return the `[3, 3]` matrix of a quaternion that maps axes to axes."""
    w, x, y, z = turn
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.round(matrix)


def turn_harmonics(matrix: NDArray[np.float64], sh: Float32) -> Float32:
    """Rotate SH `[N, k, 3]` of degree 0 or 1 by a matrix `[3, 3]` (SPEC Annex C.2)."""
    turned = sh.copy()
    if sh.shape[1] > 1:
        gradient = np.stack([-sh[:, 3], -sh[:, 1], sh[:, 2]])
        x, y, z = np.tensordot(matrix, gradient, axes=1)
        turned[:, 1], turned[:, 2], turned[:, 3] = -y, z, -x
    return turned


def multiply(left: NDArray[np.float64], right: Float32) -> Float32:
    """Return the Hamilton products of `[4]` and `[N, 4]`, wxyz."""
    aw, ax, ay, az = left
    bw, bx, by, bz = right.T.astype(np.float64)
    product = [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
    return np.stack(product, axis=1).astype(np.float32)


def _apply(matrix: NDArray[np.float64], vectors: Float32) -> Float32:
    return np.ascontiguousarray((vectors @ matrix.T).astype(np.float32))


def _negate_z(splats: Splats) -> Splats:
    """Convert splats of a left-handed frame to a right-handed one by negating z."""
    sh = splats.sh.copy()
    sh[:, 2:3] *= -1
    signs = np.array([1, -1, -1, 1], dtype=np.float32)
    flip = np.array([1, 1, -1], dtype=np.float32)
    return replace(
        splats, positions=splats.positions * flip, rotations=splats.rotations * signs, sh=sh
    )
