"""Plans the pictures of a path: a time and a camera for each picture."""

import math
from collections.abc import Iterable
from pathlib import Path

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.outline import Outline
from quarc_ref.viewing.paths.automatic import PATH_PLANNERS
from quarc_ref.viewing.paths.keyframes import read_keyframes
from quarc_ref.viewing.paths.pose import PathError, PlannedPicture, WorldAxes

_MAX_ROUNDING = 1e-6  # of times, in frames


def plan_pictures(
    outline: Outline,
    path_name: str | None,
    reference_camera: Camera,
    span: tuple[int, int | None],
    picture_count: int | None = None,
) -> list[PlannedPicture]:
    """Plan the pictures of a path.

    Args:
        outline: Outline of the stream.
        path_name: `orbit`, `spiral`, `interpolate`, or the path of a JSON file; None for a camera
            that does not move.
        reference_camera: Camera that determines the picture size, the field of view and the first
            pose of the path.
        span: First frame and end frame (exclusive); an end of None includes all later frames.
        picture_count: Number of pictures, over which the frames are distributed evenly; None for
            one picture per frame. It must be None if the path is a JSON file, because the file
            defines the times of the pictures.

    Raises:
        PathError: The path is invalid, or the stream has no frames in the span.
        OSError: The file cannot be read.
    """
    first_frame, frame_count = max(span[0], outline.first_frame), outline.count_frames(*span)
    if not frame_count:
        message = "the stream has none of the requested frames"
        raise PathError(message)
    last_frame = first_frame + frame_count - 1
    axes = WorldAxes.from_stream(outline.header, outline.metadata)
    if path_name is None or path_name in PATH_PLANNERS:
        count = picture_count or frame_count
        cameras = count * [reference_camera]
        if path_name is not None:
            poses = PATH_PLANNERS[path_name](outline.cameras, reference_camera, axes, count)
            cameras = [pose.as_camera(reference_camera) for pose in poses]
        times: Iterable[float] = (
            min(first_frame + index * frame_count / count, last_frame) for index in range(count)
        )
    else:
        if picture_count is not None:
            message = (
                "a path file defines the times of its pictures, so neither their number "
                "(--pictures) nor their rate (--fps) can be chosen"
            )
            raise PathError(message)
        keyframes = read_keyframes(Path(path_name), outline.cameras, reference_camera, axes)
        frames_per_second = outline.header.frames_per_second
        poses = keyframes.interpolate(frames_per_second)
        cameras = [pose.as_camera(reference_camera) for pose in poses]
        times = keyframes.list_times(frames_per_second, first_frame, last_frame)
    return [_plan_picture(time, camera) for time, camera in zip(times, cameras, strict=True)]


def _plan_picture(time: float, camera: Camera) -> PlannedPicture:
    """Return the picture at a time in frames; a time close to a frame is that of the frame."""
    frame = math.floor(time + _MAX_ROUNDING)
    share = time - frame
    return PlannedPicture(frame, camera, share if share > _MAX_ROUNDING else 0.0)
