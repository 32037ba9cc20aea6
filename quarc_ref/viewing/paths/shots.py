"""Plans the pictures of a path: the frame and the camera of each."""

from pathlib import Path

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.outline import Outline
from quarc_ref.viewing.paths.automatic import PATHS
from quarc_ref.viewing.paths.keyframes import read_keyframes
from quarc_ref.viewing.paths.pose import PathError, Shot


def plan_shots(
    outline: Outline,
    name: str,
    like: Camera,
    span: tuple[int, int | None],
    pictures: int | None = None,
) -> list[Shot]:
    """Plan the pictures of a path.

    Args:
        outline: Outline of the stream.
        name: `orbit`, `spiral`, `interpolate`, or the path of a keyframe file.
        like: Camera with the picture size, angle of view and first pose of the path.
        span: First frame to show and the one after the last; None for all.
        pictures: Number of pictures, over which the frames are distributed; None for one
            per frame. Must be None for keyframe files, which have times.

    Raises:
        PathError: The path is invalid, or there is no such frame.
        OSError: The file cannot be read.
    """
    first, count = max(span[0], outline.first_frame), outline.count_frames(*span)
    if not count:
        message = "the stream has none of the requested frames"
        raise PathError(message)
    if name in PATHS:
        total = pictures or count
        poses = PATHS[name](outline.cameras, like, outline.header.up_axis, total)
        frames = [first + place * count // total for place in range(total)]
    else:
        if pictures is not None:
            message = (
                "a keyframe file sets its own times and cannot be combined with a number of "
                "pictures"
            )
            raise PathError(message)
        found = read_keyframes(Path(name), outline.cameras, like, outline.header.up_axis)
        pace = outline.header.frames_per_second
        poses, frames = found.at(pace), found.frames_at(pace, first, first + count - 1)
    return [Shot(frame, pose.as_camera(like)) for frame, pose in zip(frames, poses, strict=True)]
