"""The moving region of a camera's picture, where a mean over the whole picture hides errors.

The background of a camera is the median of its pictures over time. What differs
from it at a frame is the moving region, with a margin; the rest is static.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from quarc_ref.evaluation.metrics import Mask, Picture

_LEAST_FRAMES = 3
_MOST_FRAMES = 15
_LEVELS = 15  # of 255: more than the noise of cameras and codecs
_MARGIN = 2  # pixels
MOVING_VARIANT = (
    f"moving_*, static_*: over the pixels that are, or are not, within {_MARGIN} pixels of one "
    f"that differs by more than {_LEVELS} of 255 levels in any color from the camera's median over "
    f"time, of at most {_MOST_FRAMES} frames evenly spread over the capture; corrections are "
    "fitted on the whole picture"
)


def choose_frames(frame_count: int) -> list[int]:
    """Return the ordinals of the frames whose median is the background, in ascending order.

    Args:
        frame_count: Number of frames of the capture.
    """
    count = min(frame_count, _MOST_FRAMES)
    frames: list[int] = np.linspace(0, frame_count - 1, count).round().astype(int).tolist()
    return frames


def find_background(pictures: Sequence[NDArray[np.uint8]]) -> Picture | None:
    """Return `[H, W, 3]` the median over time in levels of 255.

    Args:
        pictures: `[H, W, 3]` each, those of `choose_frames`.

    Returns:
        None for fewer than three pictures: these do not show what moves.
    """
    if len(pictures) < _LEAST_FRAMES:
        return None
    median: Picture = np.median(np.stack(pictures), axis=0).astype(np.float32)
    return median


def find_moving(picture: NDArray[np.uint8], background: Picture, mask: Mask | None = None) -> Mask:
    """Return `[H, W]` whether a pixel is in the moving region.

    Args:
        picture: `[H, W, 3]` in levels of 255.
        background: `[H, W, 3]`, as `find_background` returns it.
        mask: `[H, W]` pixels that count; None for all.
    """
    differs = np.abs(picture - background).max(axis=2) > _LEVELS
    if mask is not None:
        differs &= mask
    side = 2 * _MARGIN + 1
    grown: Mask = binary_dilation(differs, np.ones((side, side), dtype=bool))
    return grown
