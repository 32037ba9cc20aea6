"""Pictures the right way up, as the display matrix of a video has them shown.

Players, `ffmpeg` and OpenCV turn the frames of a video that was filmed with the
camera on its side. So poses and intrinsics refer to upright pictures.
"""

from collections.abc import Mapping
from typing import SupportsBytes, cast

import av
import numpy as np

from quarc_ref.datasets.capture import Image


def rotate_upright(frame: av.VideoFrame) -> Image:
    """Return `[H, W, 3]` sRGB of a frame, turned by its display matrix.

    Raises:
        ValueError: The matrix is not of quarter turns alone, or the pixels
            cannot be turned into RGB.
    """
    turns, rest = divmod(frame.rotation, 90)  # counterclockwise, as numpy has it
    if rest or _is_mirrored(frame):
        by = "mirrored" if not rest else f"turned by {frame.rotation} degrees"
        message = f"it is to be shown {by}, and only turns by 90, 180 or 270 degrees are supported"
        raise ValueError(message)
    picture = frame.to_ndarray(format="rgb24")
    return np.ascontiguousarray(np.rot90(picture, turns), dtype=np.uint8)


def _is_mirrored(frame: av.VideoFrame) -> bool:
    try:
        matrix = cast("Mapping[str, SupportsBytes]", frame.side_data)["DISPLAYMATRIX"]
    except (KeyError, ValueError):  # it has none, or side data of a kind that PyAV does not know
        return False
    a, b, _, c, d = np.frombuffer(bytes(matrix), np.int32)[:5].tolist()
    return bool(a * d < b * c)
