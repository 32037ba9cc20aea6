"""Depth as whole numbers of 16 bits, for PNG files."""

import numpy as np
from numpy.typing import NDArray

_MOST = (1 << 16) - 1
_OPAQUE = 0.5  # the least opacity of a pixel whose depth means something


def quantize_depth(
    depth: NDArray[np.float32], opacity: NDArray[np.float32]
) -> tuple[NDArray[np.uint16], float]:
    """Return depth in levels, and how many world units a level is.

    Args:
        depth: `[H, W]` world units.
        opacity: `[H, W]` 0 to 1.

    Returns:
        `[H, W]` levels, 0 for pixels that are not opaque enough to have a depth. The scale is the
        least power of two at which the deepest pixel fits.
    """
    shown = np.where((opacity >= _OPAQUE) & np.isfinite(depth), depth.astype(np.float64), 0)
    deepest = float(shown.max())
    scale = float(2.0 ** np.ceil(np.log2(deepest / _MOST))) if deepest > 0 else 1.0
    levels = np.clip(np.round(shown / scale), 0, _MOST).astype(np.uint16)
    levels[(shown > 0) & (levels == 0)] = 1
    return levels, scale
