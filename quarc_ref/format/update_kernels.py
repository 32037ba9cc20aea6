"""The contexts of updates (SPEC 8.8), compiled; `update_planes` holds the plain twin."""

import numpy as np

from quarc_ref.format.compiled import entrance

_BLOCK = 4096


@entrance
def find_contexts(motion, recency):
    """Return int64 `[N]` the context of each Gaussian in the plane *changes*.

    Args:
        motion: int16 `[c, N]` what has moved it in this frame.
        recency: int16 `[N]`.
    """
    contexts = np.empty(recency.size, dtype=np.int64)
    sums = np.empty(_BLOCK, dtype=np.int32)
    for first in range(0, recency.size, _BLOCK):
        block = recency[first : first + _BLOCK]
        sums[:] = 0
        for channel in range(motion.shape[0]):
            plane = motion[channel, first : first + _BLOCK]
            for i in range(block.size):
                sums[i] += abs(plane[i])
        for i in range(block.size):
            far = sums[i]
            contexts[first + i] = 4 * ((far > 0) + (far > 1) + (far > 3)) + block[i]
    return contexts
