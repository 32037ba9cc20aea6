"""Detects the moving region of pictures; a mean over all pixels would hide errors in this region.

The background of a camera is the median of its pictures over time. The moving region
consists of the pixels that differ from the background, and of a margin around them. All other
pixels are static.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from quarc_ref.evaluation.metrics import Mask, Picture

_MIN_BACKGROUND_FRAMES = 3
_MAX_BACKGROUND_FRAMES = 15
_MIN_CHANGE = 15  # 8-bit levels: above the noise of cameras and codecs
_MARGIN_PIXELS = 2
MOVING_VARIANT = (
    "moving_*, static_*: a pixel is moving if any pixel at most "
    f"{_MARGIN_PIXELS} pixels away differs from the background by more than {_MIN_CHANGE} 8-bit "
    "levels in any color, and static otherwise; the background is the median of at most "
    f"{_MAX_BACKGROUND_FRAMES} frames of the camera, evenly spread over the capture; color "
    "corrections are fitted to the whole picture"
)


def choose_background_frames(frame_count: int) -> list[int]:
    """Return the ordinals, in ascending order, of the frames whose median is the background.

    Args:
        frame_count: Number of frames of the capture.
    """
    background_frame_count = min(frame_count, _MAX_BACKGROUND_FRAMES)
    frames: list[int] = (
        np.linspace(0, frame_count - 1, background_frame_count).round().astype(int).tolist()
    )
    return frames


def find_background(pictures: Sequence[NDArray[np.uint8]]) -> Picture | None:
    """Return the `[H, W, 3]` median of pictures over time, in 8-bit levels.

    Args:
        pictures: Pictures `[H, W, 3]` of the frames from `choose_background_frames`.

    Returns:
        The background; None for fewer than three pictures.
    """
    if len(pictures) < _MIN_BACKGROUND_FRAMES:
        return None
    median: Picture = np.median(np.stack(pictures), axis=0).astype(np.float32)
    return median


def find_moving_region(
    picture: NDArray[np.uint8], background: Picture, mask: Mask | None = None
) -> Mask:
    """Return the `[H, W]` mask of the moving region.

    Args:
        picture: `[H, W, 3]` picture in 8-bit levels.
        background: `[H, W, 3]` background from `find_background`.
        mask: `[H, W]` mask of the pixels to use; None for all pixels.
    """
    is_moving = np.abs(picture - background).max(axis=2) > _MIN_CHANGE
    if mask is not None:
        is_moving &= mask
    kernel_size = 2 * _MARGIN_PIXELS + 1
    dilated: Mask = binary_dilation(is_moving, np.ones((kernel_size, kernel_size), dtype=bool))
    return dilated
