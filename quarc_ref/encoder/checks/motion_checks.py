"""Finds cameras that are frozen, repeat frames, or are out of sync with other cameras.

Synchronized cameras see motion at the same time in the same epipolar planes. A plane through
the centers of two cameras intersects each picture in a line, and motion in the plane is
visible on both lines. The poses determine which plane a pixel belongs to. The motion in each plane
over time is correlated between the cameras at every time shift (after Ben-Artzi et al.,
"Camera Calibration from Dynamic Silhouettes Using Motion Barcodes", 2016).
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.ignored_frames import join_frames, suggest_ignoring
from quarc_ref.encoder.checks.recording import Recording
from quarc_ref.format.cameras import Camera
from quarc_ref.wording import format_count

# Relative to the median change of all cameras; video coding changes even frozen pictures.
_MAX_FROZEN_CHANGE = 0.02
_MIN_MOTION = 0.1  # minimum average change of pictures with motion, 0 to 255
_MAX_REPEATED_CHANGE = 0.02  # relative to the camera's median change
_MIN_CHANGE_OF_OTHERS = 0.3  # relative to the median changes of the other cameras
_MIN_REPEATS = 2
_MIN_FRAMES = 8
_MAX_DELAY_FRAMES = 15
_PLANE_COUNT = 48
_NEIGHBOR_COUNT = 5
_MIN_COMMON_PLANES = 6
_MIN_CORRELATION_GAIN = 0.1  # minimum increase of the correlation by a shift in time
_MIN_CORRELATION = 0.3

Numbers = NDArray[np.float64]
Changes = NDArray[np.float32]


def find_motion_faults(
    cameras: Sequence[Camera],
    recordings: Sequence[Recording],
    offsets: Mapping[str, float] | None = None,
    start: int = 0,
) -> Iterator[Finding]:
    """Yield findings about cameras whose motion differs from that of other cameras.

    Args:
        cameras: Cameras, at least two.
        recordings: Recording of each camera.
        offsets: Time offsets by camera name that the recordings have already been corrected by,
            in frames, as in `CaptureNotes`.
        start: Frame of the synchronized recording that is frame 0 of the recordings.
    """
    names = [camera.name for camera in cameras]
    changes = [recording.changes for recording in recordings]
    if not len(changes[0]):  # a single frame has no motion
        return
    is_frozen = _are_frozen(recordings)
    yield from _find_frozen(names, is_frozen)
    moving_cameras = np.flatnonzero(~is_frozen).tolist()
    if len(moving_cameras) > 1:
        yield from _find_repeats(
            [names[i] for i in moving_cameras], [recordings[i] for i in moving_cameras], start
        )
    if changes[0].shape[0] + 1 >= _MIN_FRAMES and len(moving_cameras) > 2:
        yield from _find_shifts(
            [cameras[i] for i in moving_cameras],
            [changes[i] for i in moving_cameras],
            [recordings[i].block_size for i in moving_cameras],
            offsets or {},
        )


def _are_frozen(recordings: Sequence[Recording]) -> NDArray[np.bool_]:
    """Return, for each camera, whether its readable frames never change."""
    known_changes = [
        recording.changes.mean(axis=(1, 2))[recording.is_change_known] for recording in recordings
    ]
    # A camera without known changes counts as moving, because it may be.
    mean_changes = np.array(
        [np.median(changes) if changes.size else np.inf for changes in known_changes]
    )
    known_means = mean_changes[np.isfinite(mean_changes)]
    median_change = float(np.median(known_means)) if known_means.size else 0.0
    is_frozen: NDArray[np.bool_] = (mean_changes < _MAX_FROZEN_CHANGE * median_change) & (
        median_change > _MIN_MOTION
    )
    return is_frozen


def _find_frozen(names: Sequence[str], is_frozen: NDArray[np.bool_]) -> Iterator[Finding]:
    frozen_names = tuple(names[i] for i in np.flatnonzero(is_frozen).tolist())
    if frozen_names:
        message = (
            f"the picture of {format_names(frozen_names)} never changes, while other cameras "
            "show motion: use the right file, or remove the camera"
        )
        yield Finding("frozen-camera", message, frozen_names)


def _find_repeats(
    names: Sequence[str], recordings: Sequence[Recording], start: int
) -> Iterator[Finding]:
    """Yield a finding for each camera that repeats frames while most other cameras show motion."""
    mean_changes = np.array([recording.changes.mean(axis=(1, 2)) for recording in recordings])
    median_changes = np.median(mean_changes, axis=1, keepdims=True)
    relative_changes = mean_changes / np.maximum(median_changes, 1e-9)
    for index, name in enumerate(names):
        change_of_others = np.median(np.delete(relative_changes, index, axis=0), axis=0)
        is_repeated = (
            (relative_changes[index] < _MAX_REPEATED_CHANGE)
            & (change_of_others > _MIN_CHANGE_OF_OTHERS)
            & recordings[index].is_change_known
        )
        repeated_frames = np.flatnonzero(is_repeated) + 1
        if repeated_frames.size >= _MIN_REPEATS:
            frames = [start + frame for frame in repeated_frames.tolist()]
            message = (
                f"{name} repeats the previous picture in frames {format_names([*map(str, frames)])}"
                ", probably because frames were lost in recording or conversion: convert the "
                f"original recording again, or {suggest_ignoring(name, join_frames(frames))}"
            )
            yield Finding("repeated-frames", message, (name,))


def _find_shifts(
    cameras: Sequence[Camera],
    changes: Sequence[Changes],
    block_sizes: Sequence[int],
    offsets: Mapping[str, float],
) -> Iterator[Finding]:
    for camera, shift in zip(cameras, measure_shifts(cameras, changes, block_sizes), strict=True):
        if shift:
            direction = "late" if shift > 0 else "early"
            offset = offsets.get(camera.name, 0) + shift
            delay = f"{format_count(abs(shift), 'frame')} {direction}"
            message = (
                f"the motion in {camera.name} is {delay}: in {NOTES_NAME} "
                f'in the capture, change its offset to {offset:g} ("offsets": {{"{camera.name}": '
                f"{offset:g}}}), or trim the video"
            )
            yield Finding("out-of-sync", message, (camera.name,))


def measure_shifts(
    cameras: Sequence[Camera], changes: Sequence[Changes], block_sizes: Sequence[int]
) -> list[int]:
    """Return the delay of each camera in frames; 0 if the correlation shows no clear delay.

    Args:
        cameras: Cameras, at least three, most of which are synchronized.
        changes: `[T - 1, rows, columns]` changes of each camera (`Recording.changes`).
        block_sizes: Block size of each camera (`Recording.block_size`).
    """
    motion = [_remove_constant_change(camera_changes) for camera_changes in changes]
    rays = [
        _find_rays(camera, block_size, camera_motion.shape[1:])
        for camera, block_size, camera_motion in zip(cameras, block_sizes, motion, strict=True)
    ]
    max_shift = min(_MAX_DELAY_FRAMES, len(motion[0]) // 3)
    centers = np.stack([camera_center(camera) for camera in cameras])
    shifts = []
    for index, center in enumerate(centers):
        distances = np.linalg.norm(centers - center, axis=1)
        neighbors = (neighbor for neighbor in np.argsort(distances) if distances[neighbor] > 0)
        curves = (
            _correlate(
                (motion[index], motion[neighbor]),
                (rays[index], rays[neighbor]),
                centers[neighbor] - center,
                max_shift,
            )
            for neighbor in neighbors
        )
        neighbor_curves = islice((curve for curve in curves if curve is not None), _NEIGHBOR_COUNT)
        shifts.append(_choose_shift(list(neighbor_curves), max_shift))
    return shifts


def _remove_constant_change(changes: Changes) -> Changes:
    """Subtract each pixel's median change, which is caused by noise; clamp the result at 0."""
    return np.maximum(changes - np.median(changes, axis=0), 0).astype(np.float32)


def _find_rays(camera: Camera, block_size: int, shape: tuple[int, ...]) -> Numbers:
    """Return the `[rows, columns, 3]` world-space directions of downscaled pixels."""
    rows, columns = ((np.arange(count) + 0.5) * block_size for count in shape)
    x, y = np.meshgrid((columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    world_rays: Numbers = rays @ np.array(camera.rotation).reshape(3, 3)
    return world_rays


def _correlate(
    motion: tuple[Changes, Changes],
    rays: tuple[Numbers, Numbers],
    baseline: Numbers,
    max_shift: int,
) -> Numbers | None:
    """Return `[2 * max_shift + 1]` correlations of the motion of two cameras in shared planes.

    Correlation n compares the first camera at frame t + n - max_shift with the second camera at
    frame t. The result is None if the cameras have too few planes in common.
    """
    reference_direction = rays[0].mean(axis=(0, 1))
    angles = [
        _measure_plane_angles(camera_rays, baseline, reference_direction) for camera_rays in rays
    ]
    min_angle = max(float(camera_angles.min()) for camera_angles in angles)
    max_angle = min(float(camera_angles.max()) for camera_angles in angles)
    if max_angle - min_angle <= 0:
        return None
    plane_edges = np.linspace(min_angle, max_angle, _PLANE_COUNT + 1)
    first, second = (
        _sum_by_plane(camera_motion, np.searchsorted(plane_edges, camera_angles.ravel()) - 1)
        for camera_motion, camera_angles in zip(motion, angles, strict=True)
    )
    has_motion = (first.max(axis=0) > 0) & (second.max(axis=0) > 0)
    if has_motion.sum() < _MIN_COMMON_PLANES:
        return None
    first, second = first[:, has_motion], second[:, has_motion]
    frame_count = len(first)
    correlations = []
    for shift in range(-max_shift, max_shift + 1):
        first_part = first[max(0, shift) : frame_count + min(0, shift)]
        second_part = second[max(0, -shift) : frame_count + min(0, -shift)]
        correlations.append(_correlate_planes(first_part, second_part))
    return np.array(correlations)


def _measure_plane_angles(
    rays: Numbers, baseline: Numbers, reference_direction: Numbers
) -> Numbers:
    """Return the `[rows, columns]` angles of the rays around the baseline, radians.

    Rays with the same angle are in the same epipolar half-plane.

    Args:
        rays: `[rows, columns, 3]` directions.
        baseline: `[3]` vector from one camera center to the other.
        reference_direction: `[3]` direction that determines the half-plane with angle 0.
    """
    axis = baseline / np.linalg.norm(baseline)
    # a small offset, because the reference direction may be parallel to the baseline
    reference = reference_direction + 1e-6 * np.eye(3)[np.abs(axis).argmin()]
    normal = np.cross(axis, reference)
    normal /= np.linalg.norm(normal)
    zero_direction = np.cross(normal, axis)
    angles: Numbers = np.arctan2(rays @ normal, rays @ zero_direction)
    return angles


def _sum_by_plane(motion: Changes, planes: NDArray[np.intp]) -> Numbers:
    """Return the square root of the sum of the motion in each plane, `[T, plane]`."""
    is_valid = (planes >= 0) & (planes < _PLANE_COUNT)
    sums = np.zeros((len(motion), _PLANE_COUNT))
    valid_motion = motion.reshape(len(motion), -1)[:, is_valid]
    for frame, frame_motion in enumerate(valid_motion):
        sums[frame] = np.bincount(planes[is_valid], weights=frame_motion, minlength=_PLANE_COUNT)[
            :_PLANE_COUNT
        ]
    return np.sqrt(sums)


def _correlate_planes(first: Numbers, second: Numbers) -> float:
    """Return the correlation of two motions `[T, plane]` after subtracting each plane's mean."""
    first, second = first - first.mean(axis=0), second - second.mean(axis=0)
    norm = float(np.square(first).sum() * np.square(second).sum()) ** 0.5
    return float((first * second).sum()) / norm if norm else 0.0


def _choose_shift(curves: Sequence[Numbers], max_shift: int) -> int:
    """Return the shift with the highest correlation, or 0 if no shift is clearly better than 0."""
    if not curves:
        return 0
    median_curve = np.median(np.stack(curves), axis=0)
    best_index = int(median_curve.argmax())
    is_clear = median_curve[best_index] > max(
        _MIN_CORRELATION, median_curve[max_shift] + _MIN_CORRELATION_GAIN
    )
    return best_index - max_shift if is_clear else 0
