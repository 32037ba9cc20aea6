"""Estimates time offsets of cameras with known poses from the positions of motion in the pictures.

Two cameras and a moving point span an epipolar plane. All epipolar planes contain the
baseline of the two cameras, so an angle about the baseline identifies a plane, and every
pixel lies on one of these planes. At any time, both cameras see motion at the same angles.
Comparing the angles is far more informative than comparing the total amount of motion.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quarc_ref.calibration.alignment import (
    Float64Array,
    Shift,
    align_signals,
    correlate_signals,
    subtract_running_mean,
)
from quarc_ref.calibration.signals import MOTION_WINDOW, Motion, find_downscale_factor
from quarc_ref.datasets.calibration import CalibratedCamera

_ANGLE_BINS = 96
_MIN_SHARED_BINS = 8  # minimum number of angles that both cameras see


def align_by_epipolar_motion(
    cameras: Sequence[CalibratedCamera],
    motions: Sequence[Motion],
    max_shift: int,
    peak_width: int,
) -> list[Shift]:
    """Return the shift of each camera; the median shift is 0.

    Args:
        cameras: Cameras with poses.
        motions: Motion in the pictures of each camera.
        max_shift: Maximum shift between any two cameras, in frames.
        peak_width: Maximum distance, in frames, of a shift from the peak to which it belongs.
    """
    rays = [_cast_rays(camera, motion) for camera, motion in zip(cameras, motions, strict=True)]
    centers = [-camera.pose.rotation.T @ camera.pose.translation for camera in cameras]

    def correlate(first: int, second: int) -> Float64Array | None:
        bins = _bin_angles(centers[second] - centers[first], rays[first], rays[second])
        is_shared = np.isin(np.arange(_ANGLE_BINS), bins[0]) & np.isin(
            np.arange(_ANGLE_BINS), bins[1]
        )
        if is_shared.sum() < _MIN_SHARED_BINS:
            return None
        profiles = [
            subtract_running_mean(
                _average_by_angle(motions[camera], pixel_bins)[:, is_shared], MOTION_WINDOW
            )
            for camera, pixel_bins in zip((first, second), bins, strict=True)
        ]
        return correlate_signals(profiles[0], profiles[1], max_shift)

    return align_signals(len(cameras), correlate, peak_width)


def _cast_rays(camera: CalibratedCamera, motion: Motion) -> Float64Array:
    """Return `[P, 3]` world directions of the rays through the pixels of downscaled pictures."""
    height, width = motion.shape[1:]
    lens, downscale = camera.lens, find_downscale_factor(camera.lens.width)
    y, x = np.indices((height, width)).reshape(2, -1)
    directions = np.stack(
        [
            ((x + 0.5) * downscale - lens.cx) / lens.fx,
            ((y + 0.5) * downscale - lens.cy) / lens.fy,
            np.ones(x.size),
        ],
        axis=1,
    )
    return np.asarray(directions @ camera.pose.rotation, np.float64)


def _bin_angles(baseline: Float64Array, *rays: Float64Array) -> list[NDArray[np.int64]]:
    """Assign the rays of each camera to bins by their angle about the baseline.

    The bins cover the angles that the first camera sees. The result has a `[P]` array of bin
    numbers for each camera; a ray at any other angle gets the number `_ANGLE_BINS`.
    """
    axis = baseline / max(float(np.linalg.norm(baseline)), 1e-12)
    mean_ray = rays[0].mean(axis=0)
    zero_direction = mean_ray - (mean_ray @ axis) * axis
    zero_direction /= max(float(np.linalg.norm(zero_direction)), 1e-12)
    side_direction = np.cross(axis, zero_direction)
    camera_angles = [
        np.arctan2(camera_rays @ side_direction, camera_rays @ zero_direction)
        for camera_rays in rays
    ]
    min_angle, max_angle = float(camera_angles[0].min()), float(camera_angles[0].max())
    bins = [
        np.floor((angles - min_angle) / max(max_angle - min_angle, 1e-9) * _ANGLE_BINS).astype(
            np.int64
        )
        for angles in camera_angles
    ]
    return [
        np.where((angle_bins < 0) | (angle_bins >= _ANGLE_BINS), _ANGLE_BINS, angle_bins)
        for angle_bins in bins
    ]


def _average_by_angle(motion: Motion, pixel_bins: NDArray[np.int64]) -> Float64Array:
    """Return the `[T, _ANGLE_BINS]` mean change of the pixels in each bin at each time."""
    order = np.argsort(pixel_bins, kind="stable")
    starts = np.searchsorted(pixel_bins[order], np.arange(_ANGLE_BINS + 1))
    sums = np.zeros((len(motion), _ANGLE_BINS + 1))
    sums[:, 1:] = np.cumsum(motion.reshape(len(motion), -1)[:, order], axis=1, dtype=np.float64)[
        :, np.maximum(starts[1:] - 1, 0)
    ] * (starts[1:] > 0)
    counts = np.maximum(np.diff(starts), 1)
    return np.diff(sums, axis=1) / counts
