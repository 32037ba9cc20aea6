"""Reads camera paths from JSON files (docs/schemas/camera-path.json).

{"schema": "quarc-ref/camera-path/1", "keyframes": [
{"time": 0, "camera": "cam03"},
{"time": 2.5, "position": [0, -1, 4], "target": [0, 0, 0], "fov": 40, "frame": 30}]}
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.paths.interpolation import interpolate_poses
from quarc_ref.viewing.paths.pose import PathError, Pose, Vector, find_up, look_at, pose_of

_SCHEMA = "camera-path/1"
_KEYS = {"time", "camera", "position", "target", "up", "fov", "frame"}
_MAX_BYTES = 1 << 24
_MAX_PICTURES = 1 << 20
_WIDEST = 179.0  # degrees
_MAX_NUMBER = 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Keyframes:
    """A camera path from a file.

    Attributes:
        times: `[n]` times in seconds, ascending from 0.
        poses: `[n]` poses.
        frames: `[n]` ordinals of the frames shown at these times; None for normal playback.
    """

    times: Vector
    poses: list[Pose]
    frames: list[int | None]

    def count_pictures(self, frames_per_second: float) -> int:
        """Return the number of pictures of the path.

        Raises:
            PathError: There are too many pictures.
        """
        count = float(self.times[-1]) * frames_per_second + 1
        if count > _MAX_PICTURES:
            message = f"the path has {count:.0f} pictures; at most {_MAX_PICTURES:,} are allowed"
            raise PathError(message)
        return math.floor(count + 1e-6)

    def at(self, frames_per_second: float) -> list[Pose]:
        """Return the pose of each picture."""
        count = self.count_pictures(frames_per_second)
        times = np.minimum(np.arange(count) / frames_per_second, self.times[-1])
        return interpolate_poses(self.times, self.poses, times)

    def frames_at(self, frames_per_second: float, first: int, last: int) -> list[int]:
        """Return the frame of each picture, clamped to a range.

        If no keyframe has a frame, the stream plays normally from its first frame.
        Otherwise it plays at constant speed between keyframes with frames, and pauses
        before and after them.
        """
        moments = np.arange(self.count_pictures(frames_per_second)) / frames_per_second
        known = [
            (time, frame)
            for time, frame in zip(self.times, self.frames, strict=True)
            if frame is not None
        ]
        if known:
            places = np.interp(moments, [it[0] for it in known], [float(it[1]) for it in known])
        else:
            places = first + moments * frames_per_second
        whole: list[int] = np.clip(np.floor(places + 1e-6), first, last).astype(int).tolist()
        return whole


def read_keyframes(path: Path, cameras: Sequence[Camera], like: Camera, up_axis: int) -> Keyframes:
    """Read the path in a file.

    Args:
        path: Path of the file.
        cameras: Cameras of the stream, to which the file may refer.
        like: Camera whose angle of view is used for keyframes without one.
        up_axis: Up axis from the stream's header.

    Raises:
        PathError: The file is malformed, or a pose is impossible; the message names the keyframe.
        OSError: The file cannot be read.
    """
    try:
        return parse_keyframes(path.read_bytes(), cameras, like, up_axis)
    except PathError as error:
        message = f"{path}: {error}"
        raise PathError(message) from error


def parse_keyframes(
    data: bytes, cameras: Sequence[Camera], like: Camera, up_axis: int
) -> Keyframes:
    """Parse a path from bytes; see `read_keyframes`."""
    listed = _parse_list(data)
    times: list[float] = []
    poses: list[Pose] = []
    frames: list[int | None] = []
    for number, entry in enumerate(listed):
        try:
            times.append(_take_time(entry, times))
            frames.append(_take_frame(entry, frames))
            poses.append(_take_pose(entry, cameras, like, up_axis))
        except PathError as error:
            message = f"keyframe {number}: {error}"
            raise PathError(message) from error
    return Keyframes(np.array(times) - times[0], poses, frames)


def _parse_list(data: bytes) -> list[Mapping[str, Any]]:
    try:
        found = json.loads(data[:_MAX_BYTES])
    except (ValueError, RecursionError) as error:
        message = f"it is not JSON: {error}"
        raise PathError(message) from error
    schema = f"quarc-ref/{_SCHEMA}"
    if not isinstance(found, dict) or found.get("schema") != schema:
        message = f'it has no "schema": "{schema}"'
        raise PathError(message)
    listed = found.get("keyframes")
    if not isinstance(listed, list) or not listed or set(found) != {"schema", "keyframes"}:
        message = 'it must have the keys "schema" and "keyframes" (a list) and no others'
        raise PathError(message)
    for number, entry in enumerate(listed):
        if not isinstance(entry, dict) or not set(entry) <= _KEYS:
            message = f"keyframe {number} has keys other than {', '.join(sorted(_KEYS))}"
            raise PathError(message)
    return listed


def _take_time(entry: Mapping[str, Any], before: Sequence[float]) -> float:
    time = _take_number(entry, "time")
    if before and time <= before[-1]:
        message = f"its time, {time} s, is not after that of the previous keyframe"
        raise PathError(message)
    return time


def _take_frame(entry: Mapping[str, Any], before: Sequence[int | None]) -> int | None:
    frame = entry.get("frame")
    if frame is None:
        return None
    if not isinstance(frame, int) or isinstance(frame, bool) or not 0 <= frame < 1 << 32:
        message = f"its frame is {frame!r}, which is not a frame number"
        raise PathError(message)
    if any(other is not None and other > frame for other in before):
        message = (
            f"its frame, {frame}, is before that of an earlier keyframe: streams play forward only"
        )
        raise PathError(message)
    return frame


def _take_pose(
    entry: Mapping[str, Any], cameras: Sequence[Camera], like: Camera, up_axis: int
) -> Pose:
    named = {camera.name: camera for camera in cameras}
    if "camera" in entry:
        name = entry["camera"]
        if not isinstance(name, str) or name not in named:
            message = f"the stream has no camera {name!r}; it has {', '.join(named)}"
            raise PathError(message)
        if {"position", "target", "up"} & set(entry):
            message = "it has both a camera and a position: use one of them"
            raise PathError(message)
        pose = pose_of(named[name])
        return Pose(pose.eye, pose.axes, _take_angle(entry, pose.view_angle))
    up = _take_vector(entry, "up") if "up" in entry else find_up(cameras, up_axis)
    angle = _take_angle(entry, pose_of(like).view_angle)
    return look_at(_take_vector(entry, "position"), _take_vector(entry, "target"), up, angle)


def _take_angle(entry: Mapping[str, Any], otherwise: float) -> float:
    if "fov" not in entry:
        return otherwise
    degrees = _take_number(entry, "fov")
    if not 0 < degrees < _WIDEST:
        message = f"its fov, {degrees} degrees, is not between 0 and {_WIDEST:.0f}"
        raise PathError(message)
    return math.radians(degrees)


def _take_vector(entry: Mapping[str, Any], key: str) -> Vector:
    numbers = entry.get(key)
    if not isinstance(numbers, list) or len(numbers) != 3 or not all(map(_is_number, numbers)):
        message = f"its {key} is not a list of three numbers"
        raise PathError(message)
    return np.array(numbers, dtype=np.float64)


def _take_number(entry: Mapping[str, Any], key: str) -> float:
    number = entry.get(key)
    if not _is_number(number):
        message = f"its {key} is not a number"
        raise PathError(message)
    return float(number)


def _is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < _MAX_NUMBER
