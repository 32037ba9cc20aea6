"""Initial motion residuals of a frame, from the decoded motion of the previous one.

They depend only on the decoder's state, so a resumed encode continues exactly. Gaussians
without previous motion start at the identity.
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


def start_symbols(previous: FrameState, start: FrameState, settings: MotionSettings) -> Tensor:
    """Return the `[A, c]` initial residuals of a frame in steps, not rounded.

    Args:
        previous: State of the previous frame.
        start: State after `begin_frame`.
        settings: Rule and momentum.
    """
    is_projected = settings.warm_start == "projection"
    symbols = _project(start) if is_projected else _carry(previous, start)
    return torch.tensor(symbols * settings.momentum, dtype=torch.float32)


def _project(start: FrameState) -> NDArray[np.float64]:
    """Fit each Gaussian's previous motion level by level, from coarse to fine.

    An anchor starts at the mean of its Gaussians' motion that remains after coarser levels.
    """
    left = start.motion.astype(np.float64)
    starts = []
    levels = zip(start.known_anchors.levels, start.known_anchors.binding, strict=True)
    for level, binding in reversed(list(levels)):
        followers = np.maximum(np.bincount(binding, minlength=level.owners.size), 1)
        sums = [np.bincount(binding, row, minlength=level.owners.size) for row in left]
        mean = np.stack(sums) / followers
        left = left - mean[:, binding]
        starts.append(mean.T)
    return np.concatenate(starts[::-1])


def _carry(previous: FrameState, start: FrameState) -> NDArray[np.float64]:
    """Return the anchors' previous symbols; after resampling, the mean of the nearest ones."""
    new_levels = start.known_anchors.levels
    if previous.anchors is None:
        count = sum(level.owners.size for level in new_levels)
        return np.zeros((count, start.motion.shape[0]))
    old_levels = zip(previous.anchors.levels, previous.symbols, strict=True)
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
