"""Quantizes depth to 16-bit integers for PNG files."""

import numpy as np
from numpy.typing import NDArray

_MAXIMUM = (1 << 16) - 1
_OPAQUE = 0.5  # minimum opacity of a pixel with a meaningful depth


def quantize_depth(
    depth: NDArray[np.float32], opacity: NDArray[np.float32]
) -> tuple[NDArray[np.uint16], float]:
    """Quantize depth; return levels and the size of a level in world units.

    Args:
        depth: `[H, W]` depths, world units.
        opacity: `[H, W]` opacities from 0 to 1.

    Returns:
        `[H, W]` levels, 0 for pixels that are not opaque enough, and the scale, which is
        the smallest power of two for which the deepest pixel fits.
    """
    shown = np.where((opacity >= _OPAQUE) & np.isfinite(depth), depth.astype(np.float64), 0)
    deepest = float(shown.max())
    scale = float(2.0 ** np.ceil(np.log2(deepest / _MAXIMUM))) if deepest > 0 else 1.0
    levels = np.clip(np.round(shown / scale), 0, _MAXIMUM).astype(np.uint16)
    levels[(shown > 0) & (levels == 0)] = 1
    return levels, scale
