"""Computes initial motion residuals of a frame from the decoded motion of the previous frame.

The residuals depend only on the decoder's state, so a resumed encode gives the same bytes.
Gaussians whose previous motion is unknown, such as new ones, start without motion.
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

_NEIGHBOR_COUNT = 3


def initial_residuals(previous: FrameState, start: FrameState, settings: MotionSettings) -> Tensor:
    """Return the `[A, c]` unrounded initial residuals of a frame, in quantization steps.

    Args:
        previous: State of the previous frame.
        start: State of this frame after `begin_frame`.
        settings: Motion settings; only `warm_start` and `momentum` are used.
    """
    should_project = settings.warm_start == "projection"
    residuals = _project_motion(start) if should_project else _carry_symbols(previous, start)
    return torch.tensor(residuals * settings.momentum, dtype=torch.float32)


def _project_motion(start: FrameState) -> NDArray[np.float64]:
    """Fit residuals to the previous motion of the Gaussians, from the coarsest level to the finest.

    The residual of an anchor is the mean, over its Gaussians, of the motion that remains after
    the residuals of the coarser levels are subtracted.
    """
    remaining_motion = start.motion.astype(np.float64)
    level_means = []
    levels_and_bindings = zip(
        start.required_anchors.levels, start.required_anchors.binding, strict=True
    )
    for level, binding in reversed(list(levels_and_bindings)):
        follower_counts = np.maximum(np.bincount(binding, minlength=level.owners.size), 1)
        sums = [np.bincount(binding, row, minlength=level.owners.size) for row in remaining_motion]
        level_mean = np.stack(sums) / follower_counts
        remaining_motion = remaining_motion - level_mean[:, binding]
        level_means.append(level_mean.T)
    return np.concatenate(level_means[::-1])


def _carry_symbols(previous: FrameState, start: FrameState) -> NDArray[np.float64]:
    """Return each anchor's previous symbols; for a resampled anchor, those of nearby anchors."""
    new_levels = start.required_anchors.levels
    if previous.anchors is None:
        anchor_count = sum(level.owners.size for level in new_levels)
        return np.zeros((anchor_count, start.motion.shape[0]))
    is_resampled = previous.scene.phase % previous.scene.header.resample_interval == 0
    if not is_resampled:  # the anchors of both frames are the same (SPEC 7.4)
        return np.concatenate(previous.symbols, axis=1).T.astype(np.float64)
    old_levels = zip(previous.anchors.levels, previous.symbols, strict=True)
    return np.concatenate(
        [
            _average_nearest_symbols(old_level, symbols, new_level)
            for (old_level, symbols), new_level in zip(old_levels, new_levels, strict=True)
        ]
    )


def _average_nearest_symbols(
    old_level: AnchorLevel, symbols: Int64, new_level: AnchorLevel
) -> NDArray[np.float64]:
    """Return the `[a, c]` mean symbols of the old anchors nearest to each new anchor."""
    neighbor_count = min(_NEIGHBOR_COUNT, old_level.owners.size)
    _, nearest_indices = cKDTree(old_level.positions.T).query(
        new_level.positions.T, k=[*range(1, neighbor_count + 1)]
    )
    mean_symbols: NDArray[np.float64] = symbols.T[nearest_indices].mean(axis=1)
    return mean_symbols
