"""Rotates the frames of a video upright, according to the video's display matrix.

Players, `ffmpeg` and OpenCV rotate videos that were recorded with the camera on its side, so poses
and intrinsics are expected to refer to upright pictures.
"""

from collections.abc import Mapping
from typing import NoReturn, SupportsBytes, cast

import av
import numpy as np
from av.video.reformatter import Interpolation

from quarc_ref.datasets.capture import Image

MAX_LEVEL_BITS = 8
FLAG_REMEDY = "remove the flag (ffmpeg -display_rotation 0 -i OLD.mp4 -c copy NEW.mp4)"
_ACCURATE = Interpolation.BILINEAR | Interpolation.FULL_CHR_H_INT


def rotate_upright(frame: av.VideoFrame) -> Image:
    """Return a frame as `[H, W, 3]` sRGB, rotated according to its display matrix.

    The levels of 8-bit video are those of pictures that FFmpeg or OpenCV extract from it: if its
    chroma is subsampled, the conversion truncates, so they are about one level darker than those of
    the pictures that were encoded. Levels of more bits are rounded to 8 bits, because FFmpeg and
    OpenCV extract different ones, with errors of up to 4 levels.

    Raises:
        ValueError: The rotation is not by a multiple of 90 degrees, or the pixels cannot be
            converted to RGB.
    """
    quarter_turns, remainder = divmod(frame.rotation, 90)  # counterclockwise, as in `np.rot90`
    if remainder:
        _reject(f"rotated by {frame.rotation} degrees")
    is_deep = frame.format.components[0].bits > MAX_LEVEL_BITS
    picture = frame.to_ndarray(format="rgb24", interpolation=_ACCURATE if is_deep else None)
    return np.ascontiguousarray(np.rot90(picture, quarter_turns), dtype=np.uint8)


def require_unmirrored(frame: av.VideoFrame) -> None:
    """Check that the display matrix of a frame does not mirror it.

    Reading the matrix makes a reference cycle, so the frame stays in memory, with threads of
    FFmpeg, until Python's garbage collector runs. Only one frame of a video should be checked.

    Raises:
        ValueError: The matrix mirrors the frame.
    """
    if _is_mirrored(frame):
        _reject("mirrored")


def suggest_size_remedy(
    size: tuple[int, int], calibrated_size: tuple[float, float], rotation: int
) -> str:
    """Return what to do if pictures do not have the size for which they were calibrated.

    Args:
        size: Width and height of the upright pictures, pixels.
        calibrated_size: Width and height in the calibration, pixels.
        rotation: Degrees by which a video is rotated upright; 0 for pictures.
    """
    width, height = size
    if calibrated_size[0] != height or calibrated_size[1] != width:
        return "resize the pictures, or scale the calibration"
    if rotation % 180:
        return (
            "a rotation flag turns the pictures; if the calibration is for the pictures as stored, "
            f"{FLAG_REMEDY}"
        )
    return "rotate the pictures by 90 degrees, or calibrate them as they are"


def _reject(transformation: str) -> NoReturn:
    message = (
        f"the picture is stored {transformation}, but only rotations by 90, 180 or 270 degrees "
        "are supported"
    )
    raise ValueError(message)


def _is_mirrored(frame: av.VideoFrame) -> bool:
    try:
        matrix = cast("Mapping[str, SupportsBytes]", frame.side_data)["DISPLAYMATRIX"]
    # The frame has no matrix, or PyAV does not know this type of side data.
    except (KeyError, ValueError):
        return False
    a, b, _, c, d = np.frombuffer(bytes(matrix), np.int32)[:5].tolist()
    return bool(a * d < b * c)
