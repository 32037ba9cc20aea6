"""Fits the symbols of anchors so that the anchors move Gaussians to their targets.

The levels are fitted from the coarsest to the finest. Each anchor is set to the median of its
Gaussians' remaining motion, in quantization steps. The median ignores outliers, which finer
levels and updates can code. A second sweep fits each level to the motion that remains after the
motion of the other levels is subtracted. Finally, symbols of an anchor are set to 0 if its
Gaussians stay within the tolerances without them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.rotations import Float64, rotations_between
from quarc_ref.encoder.scenes.slack import Slack
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import ROTATION_ONE, SYMBOL_LIMIT

_SWEEP_COUNT = 2
_MAX_ROTATION_STEPS = 190.0  # largest sum of symbols of three levels


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest allowed errors of the motion, in quantization steps.

    Attributes:
        translation: Error per axis, in translation steps.
        rotation: Error of each component of a rotation residual, in rotation steps.
    """

    translation: float
    rotation: float

    def by_channels(self, slack: Slack) -> tuple[tuple[slice, Float64], ...]:
        """Return the slices of translation and rotation channels with their `[N]` tolerances."""
        return (
            (slice(0, 3), self.translation * slack.position),
            (slice(3, 6), self.rotation * slack.rotation),
        )


def fit_motion(
    start: FrameState, target: Target, rows: Int64, tolerances: Tolerances
) -> list[Int64]:
    """Return the `[6, a]` motion symbols of each level, level 1 first.

    Args:
        start: State of the frame after the deaths.
        target: Gaussians that the frame approximates.
        rows: `[N]` row of the target for each Gaussian; -1 for Gaussians that updates delete.
        tolerances: Largest allowed errors.
    """
    survivors = np.flatnonzero(rows >= 0)
    target_motion = _measure_motion(start, target, rows, survivors)
    symbols = _fit_levels(start.required_anchors, target_motion, survivors)
    channel_tolerances = tolerances.by_channels(target.slack.select(rows[survivors]))
    return _drop_unneeded_symbols(
        start.required_anchors, symbols, target_motion, survivors, channel_tolerances
    )


def _measure_motion(start: FrameState, target: Target, rows: Int64, survivors: Int64) -> Float64:
    """Return the `[6, n]` motions of Gaussians to their targets, in unrounded steps."""
    scene, header = start.scene, start.scene.header
    target_rows = rows[survivors]
    translations = target.positions[:, target_rows] - scene.positions[:, survivors]
    rotations = rotations_between(
        scene.rotations[:, survivors] / ROTATION_ONE, target.rotations[:, target_rows]
    )
    unity_sum = header.rotation_unity * header.level_count
    rotation_steps = unity_sum * rotations[1:] / np.maximum(rotations[0], 1e-6)
    return np.concatenate(
        [
            translations / header.translation_step,
            np.clip(rotation_steps, -_MAX_ROTATION_STEPS, _MAX_ROTATION_STEPS),
        ]
    )


def _fit_levels(anchors: Anchors, target_motion: Float64, survivors: Int64) -> list[Int64]:
    """Fit the symbols of all levels, from the coarsest to the finest, in several sweeps."""
    symbols = [np.zeros((6, level.owners.size), dtype=np.int64) for level in anchors.levels]
    remaining_motion = target_motion.copy()
    for _ in range(_SWEEP_COUNT):
        for level_index in reversed(range(len(symbols))):
            anchor_indices = anchors.binding[level_index, survivors]
            remaining_motion += symbols[level_index][:, anchor_indices]
            medians = find_medians(remaining_motion, anchor_indices, symbols[level_index].shape[1])
            symbols[level_index] = np.clip(np.rint(medians), -SYMBOL_LIMIT, SYMBOL_LIMIT).astype(
                int
            )
            remaining_motion -= symbols[level_index][:, anchor_indices]
    return symbols


def find_medians(values: Float64, anchor_indices: Int32, anchor_count: int) -> Float64:
    """Return the `[c, anchor_count]` medians of values over the Gaussians of each anchor.

    If there are two middle values, the median is the one nearer to 0, or 0 if their signs
    differ. The median of an anchor without Gaussians is 0.

    Args:
        values: `[c, n]` values of each Gaussian.
        anchor_indices: `[n]` anchor of each Gaussian.
        anchor_count: Number of anchors.
    """
    follower_counts = np.bincount(anchor_indices, minlength=anchor_count)
    starts = np.cumsum(follower_counts) - follower_counts
    has_values = follower_counts > 0
    starts, follower_counts = starts[has_values], follower_counts[has_values]
    medians = np.zeros((len(values), anchor_count))
    for row, median in zip(values, medians, strict=True):
        sorted_values = row[np.lexsort((row, anchor_indices))]
        lower, upper = (
            sorted_values[starts + (follower_counts - 1) // 2],
            sorted_values[starts + follower_counts // 2],
        )
        nearer_to_zero = np.where(np.abs(lower) < np.abs(upper), lower, upper)
        median[has_values] = np.where(lower * upper < 0, 0, nearer_to_zero)
    return medians


def _drop_unneeded_symbols(
    anchors: Anchors,
    symbols: list[Int64],
    target_motion: Float64,
    survivors: Int64,
    channel_tolerances: Sequence[tuple[slice, Float64]],
) -> list[Int64]:
    """Set unneeded symbols to 0, from the finest to the coarsest level.

    A symbol is needed if setting it to 0 would move a Gaussian out of its tolerance.
    """
    bindings = anchors.binding[:, survivors]
    remaining_motion = target_motion - sum(
        level_symbols[:, level_binding]
        for level_symbols, level_binding in zip(symbols, bindings, strict=True)
    )
    reduced_symbols = [level_symbols.copy() for level_symbols in symbols]
    for level_symbols, level_binding in zip(reduced_symbols, bindings, strict=True):
        for channels, tolerance in channel_tolerances:
            motion_without_symbols = (
                remaining_motion[channels] + level_symbols[channels][:, level_binding]
            )
            is_needed = np.zeros(level_symbols.shape[1], dtype=np.bool_)
            exceeds_tolerance = (np.abs(motion_without_symbols).max(axis=0) > tolerance) & (
                np.abs(remaining_motion[channels]).max(axis=0) <= tolerance
            )
            is_needed[level_binding[exceeds_tolerance]] = True
            level_symbols[channels] *= is_needed
            remaining_motion[channels] = (
                motion_without_symbols - level_symbols[channels][:, level_binding]
            )
    return reduced_symbols
