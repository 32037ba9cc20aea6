"""Reads camera paths from JSON files (docs/schemas/camera-path.json).

Example of a file:

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
from quarc_ref.viewing.paths.pose import (
    PathError,
    Pose,
    Vector,
    WorldAxes,
    find_up,
    get_camera_pose,
    look_at,
)

_SCHEMA = "camera-path/1"
_KEYFRAME_KEYS = {"time", "camera", "position", "target", "up", "fov", "frame"}
_MAX_BYTES = 1 << 24
_MAX_PICTURES = 1 << 20
_MIN_FIELD_OF_VIEW, _MAX_FIELD_OF_VIEW = 1e-6, 179.0  # degrees
_MAX_NUMBER = 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Keyframes:
    """A camera path from a file.

    Attributes:
        times: `[n]` times in seconds, ascending from 0.
        poses: `[n]` poses.
        frames: `[n]` ordinals of the frames at these times; None for keyframes without a frame.
    """

    times: Vector
    poses: list[Pose]
    frames: list[int | None]

    def count_pictures(self, frames_per_second: float) -> int:
        """Return the number of pictures in the path.

        Raises:
            PathError: The path has too many pictures.
        """
        picture_count = float(self.times[-1]) * frames_per_second + 1
        if picture_count > _MAX_PICTURES:
            message = (
                f"the path has {picture_count:.0f} pictures; at most {_MAX_PICTURES:,} are allowed"
            )
            raise PathError(message)
        return math.floor(picture_count + 1e-6)

    def interpolate(self, frames_per_second: float) -> list[Pose]:
        """Return the interpolated pose of each picture.

        Raises:
            PathError: The path has too many pictures, or the rotation of a camera is singular.
        """
        picture_count = self.count_pictures(frames_per_second)
        times = np.minimum(np.arange(picture_count) / frames_per_second, self.times[-1])
        return interpolate_poses(self.times, self.poses, times)

    def list_times(self, frames_per_second: float, first: int, last: int) -> Vector:
        """Return the time of each picture in frames, clamped to the range from `first` to `last`.

        If no keyframe has a frame, the stream plays at its frame rate, starting at frame `first`.
        Otherwise, the stream plays at constant speed between consecutive keyframes that have a
        frame. It pauses before the first and after the last of these keyframes.
        """
        picture_times = np.arange(self.count_pictures(frames_per_second)) / frames_per_second
        timed_frames = [
            (time, frame)
            for time, frame in zip(self.times, self.frames, strict=True)
            if frame is not None
        ]
        if timed_frames:
            frame_times = np.interp(
                picture_times,
                [entry[0] for entry in timed_frames],
                [float(entry[1]) for entry in timed_frames],
            )
        else:
            frame_times = first + picture_times * frames_per_second
        clamped_times: Vector = np.clip(frame_times, first, last)
        return clamped_times


def read_keyframes(
    path: Path, cameras: Sequence[Camera], reference_camera: Camera, axes: WorldAxes
) -> Keyframes:
    """Read a camera path from a file.

    Args:
        path: Path of the file.
        cameras: Cameras of the stream; keyframes may refer to them by name.
        reference_camera: Camera whose field of view is the default for keyframes.
        axes: Axes of the stream.

    Raises:
        PathError: The file is malformed, or a pose is invalid; the message names the keyframe.
        OSError: The file cannot be read.
    """
    try:
        return parse_keyframes(path.read_bytes(), cameras, reference_camera, axes)
    except PathError as error:
        message = f"{path}: {error}"
        raise PathError(message) from error


def parse_keyframes(
    data: bytes, cameras: Sequence[Camera], reference_camera: Camera, axes: WorldAxes
) -> Keyframes:
    """Parse the bytes of a camera path; see `read_keyframes`."""
    entries = _parse_entries(data)
    times: list[float] = []
    poses: list[Pose] = []
    frames: list[int | None] = []
    for number, entry in enumerate(entries):
        try:
            times.append(_read_time(entry, times))
            frames.append(_read_frame(entry, frames))
            poses.append(_read_pose(entry, cameras, reference_camera, axes))
        except PathError as error:
            message = f"keyframe {number}: {error}"
            raise PathError(message) from error
    return Keyframes(np.array(times) - times[0], poses, frames)


def _parse_entries(data: bytes) -> list[Mapping[str, Any]]:
    try:
        document = json.loads(data[:_MAX_BYTES])
    except (ValueError, RecursionError) as error:
        message = f"the file is not JSON: {error}"
        raise PathError(message) from error
    schema = f"quarc-ref/{_SCHEMA}"
    if not isinstance(document, dict) or document.get("schema") != schema:
        message = f'the file must contain "schema": "{schema}"'
        raise PathError(message)
    entries = document.get("keyframes")
    if not isinstance(entries, list) or not entries or set(document) != {"schema", "keyframes"}:
        message = 'the file must have only the keys "schema" and "keyframes" (a nonempty list)'
        raise PathError(message)
    for number, entry in enumerate(entries):
        if not isinstance(entry, dict) or not set(entry) <= _KEYFRAME_KEYS:
            message = (
                f"keyframe {number} may only have the keys {', '.join(sorted(_KEYFRAME_KEYS))}"
            )
            raise PathError(message)
    return entries


def _read_time(entry: Mapping[str, Any], earlier_times: Sequence[float]) -> float:
    time = _read_number(entry, "time")
    if earlier_times and time <= earlier_times[-1]:
        message = f"the time {time} s is not later than the time of the previous keyframe"
        raise PathError(message)
    return time


def _read_frame(entry: Mapping[str, Any], earlier_frames: Sequence[int | None]) -> int | None:
    frame = entry.get("frame")
    if frame is None:
        return None
    if not isinstance(frame, int) or isinstance(frame, bool) or not 0 <= frame < 1 << 32:
        message = f"the frame must be a frame number, not {frame!r}"
        raise PathError(message)
    if any(earlier_frame is not None and earlier_frame > frame for earlier_frame in earlier_frames):
        message = (
            f"frame {frame} follows a keyframe with a later frame; frames must be in order, "
            "because streams play only forward"
        )
        raise PathError(message)
    return frame


def _read_pose(
    entry: Mapping[str, Any],
    cameras: Sequence[Camera],
    reference_camera: Camera,
    axes: WorldAxes,
) -> Pose:
    camera_by_name = {camera.name: camera for camera in cameras}
    if "camera" in entry:
        name = entry["camera"]
        if not isinstance(name, str) or name not in camera_by_name:
            message = (
                f"the stream has no camera {name!r}; its cameras are {', '.join(camera_by_name)}"
            )
            raise PathError(message)
        if {"position", "target", "up"} & set(entry):
            message = "a camera cannot be combined with a position, target or up direction"
            raise PathError(message)
        pose = get_camera_pose(camera_by_name[name])
        return Pose(pose.eye, pose.axes, _read_field_of_view(entry, pose.view_angle))
    up = _read_vector(entry, "up") if "up" in entry else find_up(cameras, axes)
    view_angle = _read_field_of_view(entry, get_camera_pose(reference_camera).view_angle)
    eye, target = (_read_vector(entry, key) for key in ("position", "target"))
    return look_at(eye, target, up, view_angle, right_handed=axes.right_handed)


def _read_field_of_view(entry: Mapping[str, Any], default: float) -> float:
    if "fov" not in entry:
        return default
    degrees = _read_number(entry, "fov")
    if not _MIN_FIELD_OF_VIEW <= degrees < _MAX_FIELD_OF_VIEW:
        message = (
            f"the fov of {degrees} degrees is not between {_MIN_FIELD_OF_VIEW} and "
            f"{_MAX_FIELD_OF_VIEW:.0f}"
        )
        raise PathError(message)
    return math.radians(degrees)


def _read_vector(entry: Mapping[str, Any], key: str) -> Vector:
    numbers = entry.get(key)
    if not isinstance(numbers, list) or len(numbers) != 3 or not all(map(_is_number, numbers)):
        message = f"the {key} is not a list of three numbers"
        raise PathError(message)
    return np.array(numbers, dtype=np.float64)


def _read_number(entry: Mapping[str, Any], key: str) -> float:
    number = entry.get(key)
    if not _is_number(number):
        message = f"the {key} is not a number"
        raise PathError(message)
    return float(number)


def _is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < _MAX_NUMBER
