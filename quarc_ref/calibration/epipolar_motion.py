"""Estimates time offsets from the image positions of motion, for cameras that have poses.

Two cameras and a moving point span an epipolar plane. All epipolar planes contain the
baseline of the two cameras, so an angle about the baseline identifies each plane, and
each pixel of either camera belongs to one angle. Both cameras see motion at the same
angles at the same time, which is far more informative than the total amount of motion.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quarc_ref.calibration.alignment import Numbers, Shift, align, correlate_signals, flatten
from quarc_ref.calibration.signals import WINDOW, Motion, find_step
from quarc_ref.datasets.calibration import CalibratedCamera

_ANGLES = 96
_MIN_SHARED = 8  # minimum number of angles that both cameras see


def align_by_epipolar_motion(
    cameras: Sequence[CalibratedCamera],
    motions: Sequence[Motion],
    most_shift: int,
    peak_width: int,
) -> list[Shift]:
    """Return the shift of each camera; their median is 0.

    Args:
        cameras: Cameras with poses.
        motions: `[camera]` motion in the pictures of each camera.
        most_shift: Largest shift between any two cameras, in frames.
        peak_width: Number of frames on either side of a shift that count as the same shift.
    """
    rays = [_cast_rays(camera, motion) for camera, motion in zip(cameras, motions, strict=True)]
    centers = [-camera.pose.rotation.T @ camera.pose.translation for camera in cameras]

    def correlate(first: int, second: int) -> Numbers | None:
        angles = _measure_angles(centers[second] - centers[first], rays[first], rays[second])
        shared = np.isin(np.arange(_ANGLES), angles[0]) & np.isin(np.arange(_ANGLES), angles[1])
        if shared.sum() < _MIN_SHARED:
            return None
        profiles = [
            flatten(_sum_by_angle(motions[camera], labels)[:, shared], WINDOW)
            for camera, labels in zip((first, second), angles, strict=True)
        ]
        return correlate_signals(profiles[0], profiles[1], most_shift)

    return align(len(cameras), correlate, peak_width)


def _cast_rays(camera: CalibratedCamera, motion: Motion) -> Numbers:
    """Return `[P, 3]` world directions of the pixels of a motion."""
    height, width = motion.shape[1:]
    lens, step = camera.lens, find_step(camera.lens.width)
    y, x = np.indices((height, width)).reshape(2, -1)
    directions = np.stack(
        [
            ((x + 0.5) * step - lens.cx) / lens.fx,
            ((y + 0.5) * step - lens.cy) / lens.fy,
            np.ones(x.size),
        ],
        axis=1,
    )
    return np.asarray(directions @ camera.pose.rotation, np.float64)


def _measure_angles(baseline: Numbers, *rays: Numbers) -> list[NDArray[np.int64]]:
    """Return `[P]` the bins of the angles about a baseline, for the rays of each camera.

    There are `_ANGLES` bins, over the angles that the first camera sees.
    """
    axis = baseline / max(float(np.linalg.norm(baseline)), 1e-12)
    toward = rays[0].mean(axis=0)
    zero = toward - (toward @ axis) * axis
    zero /= max(float(np.linalg.norm(zero)), 1e-12)
    side = np.cross(axis, zero)
    turns = [np.arctan2(ray @ side, ray @ zero) for ray in rays]
    least, most = float(turns[0].min()), float(turns[0].max())
    bins = [
        np.floor((turn - least) / max(most - least, 1e-9) * _ANGLES).astype(np.int64)
        for turn in turns
    ]
    return [np.where((each < 0) | (each >= _ANGLES), _ANGLES, each) for each in bins]


def _sum_by_angle(motion: Motion, labels: NDArray[np.int64]) -> Numbers:
    """Return `[T, _ANGLES]` mean changes of the pixels of each angle."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(_ANGLES + 1))
    sums = np.zeros((len(motion), _ANGLES + 1))
    sums[:, 1:] = np.cumsum(motion.reshape(len(motion), -1)[:, order], axis=1, dtype=np.float64)[
        :, np.maximum(starts[1:] - 1, 0)
    ] * (starts[1:] > 0)
    counts = np.maximum(np.diff(starts), 1)
    return np.diff(sums, axis=1) / counts
