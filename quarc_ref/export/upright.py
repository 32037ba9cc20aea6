"""Rotates frames so that +y is up, for formats that define axes (SPEC Annex C.2).

The rotation maps coordinate axes to coordinate axes, so it only permutes and negates
positions and SH, without rounding. Quaternions are rounded.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Float32, Splats
from quarc_ref.export.clip import Clip
from quarc_ref.format.cameras import Camera

UPRIGHT_AXIS = 3  # +y, as in a stream's header
_SQRT_HALF = 0.5**0.5
# Quaternions wxyz that rotate each up axis to +y.
_UPRIGHT_ROTATIONS = {
    "+x": (_SQRT_HALF, 0.0, 0.0, _SQRT_HALF),
    "-x": (_SQRT_HALF, 0.0, 0.0, -_SQRT_HALF),
    "+y": (1.0, 0.0, 0.0, 0.0),
    "-y": (0.0, 1.0, 0.0, 0.0),
    "+z": (_SQRT_HALF, -_SQRT_HALF, 0.0, 0.0),
    "-z": (_SQRT_HALF, _SQRT_HALF, 0.0, 0.0),
}
_MIRRORED_UP_AXES = {"+z": "-z", "-z": "+z"}


def rotate_upright(splats: Splats, clip: Clip) -> Splats:
    """Rotate splats to right-handed axes with +y up.

    A stream that declares no up axis is assumed to have the up axis -y.

    Args:
        splats: Splats in the axes of the stream.
        clip: Properties of the stream, which define its axes.
    """
    if not clip.header.right_handed:
        splats = _negate_z(splats)
    quaternion = find_upright_rotation(clip)
    matrix = convert_to_matrix(quaternion)
    return replace(
        splats,
        positions=_transform_vectors(matrix, splats.positions),
        rotations=multiply_quaternions(np.array(quaternion), splats.rotations),
        sh=rotate_sh(matrix, splats.sh),
    )


def make_upright_matrix(clip: Clip) -> NDArray[np.float64]:
    """Return the `[3, 3]` matrix from the axes of a stream to right-handed axes with +y up."""
    mirror = np.diag([1.0, 1.0, 1.0 if clip.header.right_handed else -1.0])
    matrix: NDArray[np.float64] = convert_to_matrix(find_upright_rotation(clip)) @ mirror
    return matrix


def rotate_camera_upright(camera: Camera, clip: Clip) -> Camera:
    """Return a camera that sees upright splats as `camera` sees the splats of the stream."""
    rotation = np.array(camera.rotation).reshape(3, 3) @ make_upright_matrix(clip).T
    return replace(camera, rotation=tuple(rotation.ravel().tolist()))


def find_upright_rotation(clip: Clip) -> tuple[float, float, float, float]:
    """Return the quaternion wxyz that rotates right-handed axes of a stream so that +y is up."""
    up = clip.up if clip.header.right_handed else _MIRRORED_UP_AXES.get(clip.up, clip.up)
    return _UPRIGHT_ROTATIONS[up]


def convert_to_matrix(quaternion: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Return the `[3, 3]` matrix of a quaternion wxyz that maps coordinate axes to each other."""
    w, x, y, z = quaternion
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.round(matrix)


def rotate_sh(matrix: NDArray[np.float64], sh: Float32) -> Float32:
    """Rotate SH `[N, k, 3]` of degree 0 or 1 by a matrix `[3, 3]` (SPEC Annex C.2)."""
    rotated = sh.copy()
    if sh.shape[1] > 1:
        degree_1_vectors = np.stack([-sh[:, 3], -sh[:, 1], sh[:, 2]])
        x, y, z = np.tensordot(matrix, degree_1_vectors, axes=1)
        rotated[:, 1], rotated[:, 2], rotated[:, 3] = -y, z, -x
    return rotated


def multiply_quaternions(first: NDArray[np.float64], second: Float32) -> Float32:
    """Return the Hamilton products of quaternions `[4]` and `[N, 4]`, wxyz."""
    aw, ax, ay, az = first
    bw, bx, by, bz = second.T.astype(np.float64)
    product = [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
    return np.stack(product, axis=1).astype(np.float32)


def _transform_vectors(matrix: NDArray[np.float64], vectors: Float32) -> Float32:
    return np.ascontiguousarray((vectors @ matrix.T).astype(np.float32))


def _negate_z(splats: Splats) -> Splats:
    """Convert splats from left-handed to right-handed axes by negating z."""
    sh = splats.sh.copy()
    sh[:, 2:3] *= -1
    quaternion_signs = np.array([1, -1, -1, 1], dtype=np.float32)
    position_signs = np.array([1, 1, -1], dtype=np.float32)
    return replace(
        splats,
        positions=splats.positions * position_signs,
        rotations=splats.rotations * quaternion_signs,
        sh=sh,
    )
