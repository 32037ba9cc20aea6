"""Quantizes depth to 16-bit integers for PNG files."""

import numpy as np
from numpy.typing import NDArray

_MAX_LEVEL = (1 << 16) - 1
_MIN_OPACITY = 0.5  # minimum opacity of a pixel with a meaningful depth


def quantize_depth(
    depth: NDArray[np.float32], opacity: NDArray[np.float32]
) -> tuple[NDArray[np.uint16], float]:
    """Quantize depth; return the levels, and the size of one level in world units.

    Args:
        depth: `[H, W]` depths, world units.
        opacity: `[H, W]` opacities from 0 to 1.

    Returns:
        `[H, W]` levels, and the size of one level: the smallest power of two for which the
        largest depth fits in 16 bits. Pixels with an opacity below 0.5 have level 0.
    """
    valid_depth = np.where(
        (opacity >= _MIN_OPACITY) & np.isfinite(depth), depth.astype(np.float64), 0
    )
    max_depth = float(valid_depth.max())
    level_size = float(2.0 ** np.ceil(np.log2(max_depth / _MAX_LEVEL))) if max_depth > 0 else 1.0
    levels = np.clip(np.round(valid_depth / level_size), 0, _MAX_LEVEL).astype(np.uint16)
    levels[(valid_depth > 0) & (levels == 0)] = 1
    return levels, level_size
