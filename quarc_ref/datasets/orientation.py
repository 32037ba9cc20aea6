"""Rotates the frames of a video upright, according to the video's display matrix.

Players, `ffmpeg` and OpenCV rotate videos that were recorded with the camera on its side, so poses
and intrinsics are expected to refer to upright pictures.
"""

from collections.abc import Mapping
from typing import NoReturn, SupportsBytes, cast

import av
import numpy as np
from av.video.reformatter import ColorRange, Interpolation
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Image

MAX_LEVEL_BITS = 8
_MAX_LEVEL = (1 << MAX_LEVEL_BITS) - 1
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
    picture = _convert_to_rgb(frame)
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


def _convert_to_rgb(frame: av.VideoFrame) -> NDArray[np.generic]:
    bits = frame.format.components[0].bits
    if bits <= MAX_LEVEL_BITS:
        return frame.to_ndarray(format="rgb24")
    if frame.color_range != ColorRange.JPEG:
        return frame.to_ndarray(format="rgb24", interpolation=_ACCURATE)
    # A direct conversion to 8 bits makes full-range levels too bright, at white by 0.8.
    deep_bits = 10 if bits <= 10 else 12
    deep_levels = frame.to_ndarray(format=f"gbrp{deep_bits}le", interpolation=_ACCURATE)
    scale = np.float32(_MAX_LEVEL / ((1 << deep_bits) - 1))
    return np.asarray(np.rint(deep_levels * scale), dtype=np.uint8)


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
