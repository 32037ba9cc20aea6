"""Rotates the frames of a video upright, according to the video's display matrix.

Players, `ffmpeg` and OpenCV rotate videos that were recorded with the camera on its side, so poses
and intrinsics are expected to refer to upright pictures.
"""

from collections.abc import Mapping
from typing import SupportsBytes, cast

import av
import numpy as np

from quarc_ref.datasets.capture import Image


def rotate_upright(frame: av.VideoFrame) -> Image:
    """Return a frame as `[H, W, 3]` sRGB, rotated according to its display matrix.

    The levels are those of pictures that FFmpeg or OpenCV extract from the video: if its chroma is
    subsampled, the conversion truncates, so they are about one level darker than those of the
    pictures that were encoded.

    Raises:
        ValueError: The matrix is not a rotation by a multiple of 90 degrees, or the
            pixels cannot be converted to RGB.
    """
    quarter_turns, remainder = divmod(frame.rotation, 90)  # counterclockwise, as in `np.rot90`
    if remainder or _is_mirrored(frame):
        transformation = "mirrored" if not remainder else f"rotated by {frame.rotation} degrees"
        message = (
            f"the picture is stored {transformation}, but only rotations by 90, 180 or 270 "
            "degrees are supported"
        )
        raise ValueError(message)
    picture = frame.to_ndarray(format="rgb24")
    return np.ascontiguousarray(np.rot90(picture, quarter_turns), dtype=np.uint8)


def _is_mirrored(frame: av.VideoFrame) -> bool:
    try:
        matrix = cast("Mapping[str, SupportsBytes]", frame.side_data)["DISPLAYMATRIX"]
    # The frame has no matrix, or PyAV does not know this type of side data.
    except (KeyError, ValueError):
        return False
    a, b, _, c, d = np.frombuffer(bytes(matrix), np.int32)[:5].tolist()
    return bool(a * d < b * c)
