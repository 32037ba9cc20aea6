"""Chooses the pictures that `render` draws, and the frames that it decodes for them."""

import math
from typing import TYPE_CHECKING

from quarc_ref.cli.errors import UsageError
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.format.cameras import Camera
    from quarc_ref.viewing.outline import Outline
    from quarc_ref.viewing.paths.pose import PlannedPicture


def count_pictures(
    outline: "Outline",
    frame_range: tuple[int, int | None],
    pictures: int | None,
    frames_per_second: float | None,
) -> int | None:
    """Return the number of pictures; None for one picture per frame.

    Args:
        outline: Outline of the stream.
        frame_range: First frame and end frame (exclusive).
        pictures: Requested number of pictures; None for as many as the duration needs.
        frames_per_second: Requested frame rate; None for that of the stream.
    """
    if pictures is not None or frames_per_second is None:
        return pictures
    seconds = outline.count_frames(*frame_range) / outline.header.frames_per_second
    return max(1, round(seconds * frames_per_second))


def choose_planned_pictures(
    outline: "Outline",
    camera: "Camera",
    frame_range: tuple[int, int | None],
    path: str | None,
    pictures: int | None,
) -> "list[PlannedPicture]":
    """Return the pictures to render; raise UsageError if the requested frames do not exist."""
    from quarc_ref.viewing.paths.plan_pictures import plan_pictures
    from quarc_ref.viewing.paths.pose import PathError

    count = outline.count_frames(*frame_range)
    if not count:
        available_text = (
            f"{format_count(outline.count_frames(0, None), 'frame')} from {outline.first_frame} on"
        )
        message = f"--frames: the stream has none of the requested frames; it has {available_text}"
        raise UsageError(message)
    try:
        return plan_pictures(outline, path, camera, frame_range, pictures)
    except PathError as error:
        message = f"--path: {error}"
        raise UsageError(message) from error
    except FileNotFoundError as error:
        message = f"--path takes orbit, spiral, interpolate or a file, but {path} does not exist"
        raise UsageError(message) from error


def find_stop(
    outline: "Outline",
    planned_pictures: "list[PlannedPicture]",
    frame_range: tuple[int, int | None],
    path: str | None,
) -> int | None:
    """Return the end of the frames to decode: that of a path file, or of the requested frames.

    The outline ends at the first damaged chunk, and pictures are planned up to there. Decoding
    must therefore continue after the last known frame, so that damage is reported.
    """
    from quarc_ref.viewing.paths.automatic import PATH_PLANNERS

    last_picture = planned_pictures[-1]
    stop = math.ceil(last_picture.frame + last_picture.share) + 1
    is_file = path is not None and path not in PATH_PLANNERS
    return stop if is_file and stop < outline.stop else frame_range[1]
