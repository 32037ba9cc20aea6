"""Interpolates poses with SciPy splines for positions, rotations and fields of view."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial.transform import Rotation, RotationSpline

from quarc_ref.viewing.paths.pose import PathError, Pose, Vector

_MIRROR = np.array([-1.0, 1.0, 1.0])  # negates the direction to the right


def interpolate_poses(
    times: Vector, poses: Sequence[Pose], sample_times: NDArray[np.float64]
) -> list[Pose]:
    """Return the poses at sample times on a smooth path through key poses.

    Args:
        times: `[n]` times of the key poses, ascending.
        poses: `[n]` key poses, at least one.
        sample_times: `[m]` times between the first and the last of `times`.

    Raises:
        PathError: The axes of a pose are a singular matrix.
    """
    if len(poses) == 1:
        return [poses[0]] * len(sample_times)
    positions = np.array([pose.eye for pose in poses])
    key_view_angles = np.array([pose.view_angle for pose in poses])
    key_rotations, is_mirrored = _split_axes(np.stack([pose.axes for pose in poses]))
    rotations = RotationSpline(times, Rotation.from_matrix(key_rotations))
    eyes = CubicSpline(times, positions, bc_type="natural")(sample_times)
    axes = rotations(sample_times).as_matrix()
    if is_mirrored[0]:
        axes = axes * _MIRROR[:, None]
    view_angles = PchipInterpolator(times, key_view_angles)(sample_times)
    return [
        Pose(eye, pose_axes, float(angle))
        for eye, pose_axes, angle in zip(eyes, axes, view_angles, strict=True)
    ]


def _split_axes(axes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return rotations without reflection, which SciPy requires, and which poses are mirrored.

    Raises:
        PathError: A matrix is singular.
    """
    determinants = np.linalg.det(axes)
    if not determinants.all():
        message = "the rotation of a camera is a singular matrix"
        raise PathError(message)
    is_mirrored = determinants < 0
    rotations = np.where(is_mirrored[:, None, None], axes * _MIRROR[:, None], axes)
    return rotations, is_mirrored
