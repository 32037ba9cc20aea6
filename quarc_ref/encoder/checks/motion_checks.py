"""Finds cameras whose motion is frozen, stuttering, or out of sync with the others.

Synchronized cameras see motion at the same time in the same epipolar planes: a plane
through the centers of two cameras intersects both pictures in lines, and motion in the
plane is visible on both. Poses give the plane of each pixel; the times of motion in the
planes are compared at every shift (after Ben-Artzi et al., "Camera Calibration from
Dynamic Silhouettes Using Motion Barcodes", 2016).
"""

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.encoder.checks.recording import Recording
from quarc_ref.format.cameras import Camera

# relative to the change of other cameras: coding changes even frozen pictures slightly
_STILL = 0.02
_MIN_MOTION = 0.1  # levels: minimum average change of pictures with motion
_REPEATED = 0.02  # relative to a camera's usual change
_OTHERS_MOVE = 0.3  # relative to the other cameras' usual changes
_MIN_REPEATS = 2
_MIN_FRAMES = 8
_MAX_SHIFT = 15
_PLANES = 48
_NEIGHBORS = 5
_MIN_COMMON = 6  # planes
_CLEARLY = 0.1  # minimum increase of the correlation by a shift
_MIN_CORRELATION = 0.3

Numbers = NDArray[np.float64]
Changes = NDArray[np.float32]


def find_motion_faults(
    cameras: Sequence[Camera], recordings: Sequence[Recording]
) -> Iterator[Finding]:
    """Yield findings about cameras whose motion differs from that of the others.

    Args:
        cameras: At least two.
        recordings: Recording of each camera.
    """
    names = [camera.name for camera in cameras]
    changes = [recording.changes for recording in recordings]
    if not len(changes[0]):  # a single frame has no motion
        return
    means = np.array([np.median(each.mean(axis=(1, 2))) for each in changes])
    usual = float(np.median(means))
    frozen = (means < _STILL * usual) & (usual > _MIN_MOTION)
    yield from _find_frozen(names, frozen)
    live = np.flatnonzero(~frozen).tolist()
    yield from _find_repeats([names[i] for i in live], [recordings[i] for i in live])
    if changes[0].shape[0] + 1 >= _MIN_FRAMES and len(live) > 2:
        yield from _find_shifts(
            [cameras[i] for i in live],
            [changes[i] for i in live],
            [recordings[i].side for i in live],
        )


def _find_frozen(names: Sequence[str], frozen: NDArray[np.bool_]) -> Iterator[Finding]:
    odd = tuple(names[i] for i in np.flatnonzero(frozen).tolist())
    if odd:
        message = (
            f"{format_names(odd)} shows the same picture in all frames, while other cameras "
            "show motion: use the right file, or remove the camera"
        )
        yield Finding("frozen-camera", message, odd)


def _find_repeats(names: Sequence[str], recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Yield a finding for each camera that repeats frames while most others move."""
    means = np.array([each.changes.mean(axis=(1, 2)) for each in recordings])
    usual = np.median(means, axis=1, keepdims=True)
    relative = means / np.maximum(usual, 1e-9)
    for index, name in enumerate(names):
        others = np.median(np.delete(relative, index, axis=0), axis=0)
        is_there = recordings[index].is_there
        both_there = is_there[1:] & is_there[:-1]
        repeated = (relative[index] < _REPEATED) & (others > _OTHERS_MOVE) & both_there
        repeats = np.flatnonzero(repeated) + 1
        if repeats.size >= _MIN_REPEATS:
            frames = format_names([str(frame) for frame in repeats])
            message = (
                f"{name} repeats the previous picture in frame {frames}: frames were lost in "
                "recording or conversion; convert the original recording again"
            )
            yield Finding("repeated-frames", message, (name,))


def _find_shifts(
    cameras: Sequence[Camera], changes: Sequence[Changes], sides: Sequence[int]
) -> Iterator[Finding]:
    for camera, shift in zip(cameras, measure_shifts(cameras, changes, sides), strict=True):
        if shift:
            which = "late" if shift > 0 else "early"
            message = (
                f"{camera.name} is {abs(shift)} frames {which}, judging by its motion: write "
                f'{{"offsets": {{"{camera.name}": {shift}}}}} into {NOTES_NAME} in the capture, '
                "or cut the video"
            )
            yield Finding("out-of-sync", message, (camera.name,))


def measure_shifts(
    cameras: Sequence[Camera], changes: Sequence[Changes], sides: Sequence[int]
) -> list[int]:
    """Return the delay of each camera in frames; 0 if it is unclear.

    Args:
        cameras: Cameras, at least three, most of which are synchronized.
        changes: `[T - 1, rows, columns]` changes of each camera, from `Recording`.
        sides: Width in pixels of each camera's blocks in `changes`.
    """
    motion = [_keep_motion(each) for each in changes]
    rays = [
        _find_rays(*each)
        for each in zip(cameras, sides, (m.shape[1:] for m in motion), strict=True)
    ]
    most = min(_MAX_SHIFT, len(motion[0]) // 3)
    centers = np.stack([camera_center(camera) for camera in cameras])
    shifts = []
    for index, center in enumerate(centers):
        distances = np.linalg.norm(centers - center, axis=1)
        neighbors = (other for other in np.argsort(distances) if distances[other] > 0)
        curves = (
            _correlate(
                (motion[index], motion[other]),
                (rays[index], rays[other]),
                centers[other] - center,
                most,
            )
            for other in neighbors
        )
        found = islice((curve for curve in curves if curve is not None), _NEIGHBORS)
        shifts.append(_choose_shift(list(found), most))
    return shifts


def _keep_motion(changes: Changes) -> Changes:
    """Remove permanent changes, such as noise."""
    return np.maximum(changes - np.median(changes, axis=0), 0).astype(np.float32)


def _find_rays(camera: Camera, side: int, shape: tuple[int, ...]) -> Numbers:
    """Return the `[rows, columns, 3]` world directions of downscaled pixels."""
    rows, columns = ((np.arange(count) + 0.5) * side for count in shape)
    across, down = np.meshgrid((columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy)
    rays = np.stack([across, down, np.ones_like(across)], axis=-1)
    turned: Numbers = rays @ np.array(camera.rotation).reshape(3, 3)
    return turned


def _correlate(
    motion: tuple[Changes, Changes],
    rays: tuple[Numbers, Numbers],
    baseline: Numbers,
    most: int,
) -> Numbers | None:
    """Return `[2 most + 1]` correlations of two cameras' motion in their common planes.

    Item n is the correlation of the first camera, `n - most` frames later, with the
    second. Returns None if they have too few planes in common.
    """
    middle = rays[0].mean(axis=(0, 1))
    angles = [_find_planes(each, baseline, middle) for each in rays]
    low, high = (
        pick(float(bound(each)) for each in angles)
        for pick, bound in ((max, np.min), (min, np.max))
    )
    if high - low <= 0:
        return None
    edges = np.linspace(low, high, _PLANES + 1)
    first, second = (
        _sum_by_plane(each, np.searchsorted(edges, angle.ravel()) - 1)
        for each, angle in zip(motion, angles, strict=True)
    )
    moving = (first.max(axis=0) > 0) & (second.max(axis=0) > 0)
    if moving.sum() < _MIN_COMMON:
        return None
    first, second = first[:, moving], second[:, moving]
    count = len(first)
    curve = []
    for shift in range(-most, most + 1):
        ours = first[max(0, shift) : count + min(0, shift)]
        theirs = second[max(0, -shift) : count + min(0, -shift)]
        curve.append(_correlate_planes(ours, theirs))
    return np.array(curve)


def _find_planes(rays: Numbers, baseline: Numbers, middle: Numbers) -> Numbers:
    """Return the `[rows, columns]` angles of half-planes about the baseline, in radians.

    Args:
        rays: `[rows, columns, 3]` directions.
        baseline: `[3]` from one center to the other.
        middle: `[3]` direction whose half-plane has an angle of about 0.
    """
    axis = baseline / np.linalg.norm(baseline)
    # the direction may be the axis itself
    aside = middle + 1e-6 * np.eye(3)[np.abs(axis).argmin()]
    second = np.cross(axis, aside)
    second /= np.linalg.norm(second)
    first = np.cross(second, axis)
    angles: Numbers = np.arctan2(rays @ second, rays @ first)
    return angles


def _sum_by_plane(motion: Changes, planes: NDArray[np.intp]) -> Numbers:
    """Return `[T, plane]` amounts of motion in each plane."""
    valid = (planes >= 0) & (planes < _PLANES)
    sums = np.zeros((len(motion), _PLANES))
    flat = motion.reshape(len(motion), -1)[:, valid]
    for moment, row in enumerate(flat):
        sums[moment] = np.bincount(planes[valid], weights=row, minlength=_PLANES)[:_PLANES]
    return np.sqrt(sums)


def _correlate_planes(ours: Numbers, theirs: Numbers) -> float:
    """Return the correlation over time of motion in planes, without each plane's mean."""
    ours, theirs = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    size = float(np.square(ours).sum() * np.square(theirs).sum()) ** 0.5
    return float((ours * theirs).sum()) / size if size else 0.0


def _choose_shift(curves: Sequence[Numbers], most: int) -> int:
    """Return the shift at which a camera clearly agrees best with its neighbors, else 0."""
    if not curves:
        return 0
    mean = np.median(np.stack(curves), axis=0)
    best = int(mean.argmax())
    is_clear = mean[best] > max(_MIN_CORRELATION, mean[most] + _CLEARLY)
    return best - most if is_clear else 0
