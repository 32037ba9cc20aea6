"""Where a frame's residuals start: from the decoded motion of the frame before.

Only what the decoder knows of the last frame is used, so that a frame can be
trained anew from its file. A residual starts from the identity where there was
no motion.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from quarc_ref.decoder.anchors import AnchorLevel
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.settings.frames import MotionSettings
from quarc_ref.format.arrays import Int64

_NEIGHBORS = 3


def start_symbols(before: FrameState, begun: FrameState, settings: MotionSettings) -> Tensor:
    """Return `[A, c]` where the residuals of a frame start, in steps, not rounded.

    Args:
        before: Of the frame before.
        begun: After `begin_frame`.
        settings: Which rule, and its momentum.
    """
    start = _project(begun) if settings.warm_start == "projection" else _carry(before, begun)
    return torch.tensor(start * settings.momentum, dtype=torch.float32)


def _project(begun: FrameState) -> NDArray[np.float64]:
    """Hand each Gaussian's last motion down the levels, from coarse to fine.

    An anchor starts at the mean of what its Gaussians have left to explain.
    """
    left = begun.motion.astype(np.float64)
    starts = []
    levels = zip(begun.known_anchors.levels, begun.known_anchors.binding, strict=True)
    for level, binding in reversed(list(levels)):
        followers = np.maximum(np.bincount(binding, minlength=level.owners.size), 1)
        sums = [np.bincount(binding, row, minlength=level.owners.size) for row in left]
        mean = np.stack(sums) / followers
        left = left - mean[:, binding]
        starts.append(mean.T)
    return np.concatenate(starts[::-1])


def _carry(before: FrameState, begun: FrameState) -> NDArray[np.float64]:
    """Take over the anchors' last symbols; where they are new, the mean of the nearest old."""
    new_levels = begun.known_anchors.levels
    if before.anchors is None:
        count = sum(level.owners.size for level in new_levels)
        return np.zeros((count, begun.motion.shape[0]))
    old_levels = zip(before.anchors.levels, before.symbols, strict=True)
    return np.concatenate(
        [
            _carry_level(old, symbols, new)
            for (old, symbols), new in zip(old_levels, new_levels, strict=True)
        ]
    )


def _carry_level(old: AnchorLevel, symbols: Int64, new: AnchorLevel) -> NDArray[np.float64]:
    if new is old:
        return symbols.T.astype(np.float64)
    neighbors = min(_NEIGHBORS, old.owners.size)
    _, nearest = cKDTree(old.positions.T).query(new.positions.T, k=[*range(1, neighbors + 1)])
    mean: NDArray[np.float64] = symbols.T[nearest].mean(axis=1)
    return mean
