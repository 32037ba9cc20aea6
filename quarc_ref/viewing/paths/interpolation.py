"""Interpolates poses with SciPy splines for positions, rotations and fields of view."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial.transform import Rotation, RotationSpline

from quarc_ref.viewing.paths.pose import Pose, Vector


def interpolate_poses(
    times: Vector, poses: Sequence[Pose], sample_times: NDArray[np.float64]
) -> list[Pose]:
    """Return the poses at sample times on a smooth path through key poses.

    Args:
        times: `[n]` times of the key poses, ascending.
        poses: `[n]` key poses, at least one.
        sample_times: `[m]` times between the first and the last of `times`.
    """
    if len(poses) == 1:
        return [poses[0]] * len(sample_times)
    positions = np.array([pose.eye for pose in poses])
    key_view_angles = np.array([pose.view_angle for pose in poses])
    rotations = RotationSpline(times, Rotation.from_matrix(np.stack([pose.axes for pose in poses])))
    eyes = CubicSpline(times, positions, bc_type="natural")(sample_times)
    axes = rotations(sample_times).as_matrix()
    view_angles = PchipInterpolator(times, key_view_angles)(sample_times)
    return [
        Pose(eye, pose_axes, float(angle))
        for eye, pose_axes, angle in zip(eyes, axes, view_angles, strict=True)
    ]
