"""Interpolates poses by SciPy splines for positions, rotations and angles of view."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial.transform import Rotation, RotationSpline

from quarc_ref.viewing.paths.pose import Pose, Vector


def interpolate_poses(times: Vector, poses: Sequence[Pose], at: NDArray[np.float64]) -> list[Pose]:
    """Return poses at times, on a smooth path through the given ones.

    Args:
        times: `[n]` times of the poses, ascending.
        poses: `[n]` poses, at least one.
        at: `[m]` times between the first and the last one.
    """
    if len(poses) == 1:
        return [poses[0]] * len(at)
    places = np.array([pose.eye for pose in poses])
    angles = np.array([pose.view_angle for pose in poses])
    rotations = RotationSpline(times, Rotation.from_matrix(np.stack([pose.axes for pose in poses])))
    eyes = CubicSpline(times, places, bc_type="natural")(at)
    axes = rotations(at).as_matrix()
    view_angles = PchipInterpolator(times, angles)(at)
    return [
        Pose(eye, matrix, float(angle))
        for eye, matrix, angle in zip(eyes, axes, view_angles, strict=True)
    ]
