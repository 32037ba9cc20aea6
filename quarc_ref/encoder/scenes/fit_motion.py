"""Fits the symbols of anchors so that Gaussians move to their target positions.

From the coarsest level to the finest, each anchor gets the median, in steps, of the
remaining motion of its Gaussians. The median ignores outliers, which finer levels and
updates can handle. A second sweep fits each level to the residual of the others. The
symbols of an anchor are 0 if all its Gaussians are close enough to their targets without
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.scenes.rotations import Float64, rotations_between
from quarc_ref.encoder.scenes.slack import Slack
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import ROTATION_ONE, SYMBOL_LIMIT

_SWEEPS = 2
_MAX_ROTATION = 190.0  # largest sum of symbols of three levels


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest allowed errors, in steps of the motion.

    Attributes:
        translation: Error per axis.
        rotation: Error of a rotation residual.
    """

    translation: float
    rotation: float

    def groups(self, slack: Slack) -> tuple[tuple[slice, Float64], ...]:
        """Return groups of symbol channels, and the tolerance of each Gaussian for them."""
        return (
            (slice(0, 3), self.translation * slack.position),
            (slice(3, 6), self.rotation * slack.rotation),
        )


def fit_motion(
    start: FrameState, target: Target, rows: Int64, tolerances: Tolerances
) -> list[Int64]:
    """Return `[6, a]` symbols of each level, level 1 first.

    Args:
        start: State after the deaths.
        target: The frame.
        rows: `[N]` row of the target for each Gaussian; -1 for those that will be deleted.
        tolerances: Largest allowed errors.
    """
    alive = np.flatnonzero(rows >= 0)
    lacking = _measure(start, target, rows, alive)
    symbols = _sweep(start.known_anchors, lacking, alive)
    limits = tolerances.groups(target.slack.rows(rows[alive]))
    return _drop_unneeded(start.known_anchors, symbols, lacking, alive, limits)


def _measure(start: FrameState, target: Target, rows: Int64, alive: Int64) -> Float64:
    """Return `[6, n]` sums of symbols that move Gaussians to the target."""
    scene, header = start.scene, start.scene.header
    wanted = rows[alive]
    apart = target.positions[:, wanted] - scene.positions[:, alive]
    turns = rotations_between(scene.rotations[:, alive] / ROTATION_ONE, target.rotations[:, wanted])
    identity = header.rotation_unity * header.level_count
    turning = identity * turns[1:] / np.maximum(turns[0], 1e-6)
    return np.concatenate(
        [apart / header.translation_step, np.clip(turning, -_MAX_ROTATION, _MAX_ROTATION)]
    )


def _sweep(anchors: Anchors, lacking: Float64, alive: Int64) -> list[Int64]:
    """Fit level by level, from coarse to fine, in several sweeps."""
    symbols = [np.zeros((6, level.owners.size), dtype=np.int64) for level in anchors.levels]
    left = lacking.copy()
    for _ in range(_SWEEPS):
        for number in reversed(range(len(symbols))):
            followed = anchors.binding[number, alive]
            left += symbols[number][:, followed]
            medians = find_medians(left, followed, symbols[number].shape[1])
            symbols[number] = np.clip(np.rint(medians), -SYMBOL_LIMIT, SYMBOL_LIMIT).astype(int)
            left -= symbols[number][:, followed]
    return symbols


def find_medians(values: Float64, followed: Int32, count: int) -> Float64:
    """Return the `[c, count]` medians of the values `[c, n]` of each anchor's Gaussians.

    If there are two middle values, the one nearer to 0 is used, or 0 if they differ in
    sign. The median of no values is 0.

    Args:
        values: Values with one column per Gaussian.
        followed: `[n]` anchor of each Gaussian.
        count: Number of anchors.
    """
    sizes = np.bincount(followed, minlength=count)
    starts = np.cumsum(sizes) - sizes
    some = sizes > 0
    starts, sizes = starts[some], sizes[some]
    medians = np.zeros((len(values), count))
    for row, median in zip(values, medians, strict=True):
        ordered = row[np.lexsort((row, followed))]
        low, high = ordered[starts + (sizes - 1) // 2], ordered[starts + sizes // 2]
        nearer = np.where(np.abs(low) < np.abs(high), low, high)
        median[some] = np.where(low * high < 0, 0, nearer)
    return medians


def _drop_unneeded(
    anchors: Anchors,
    symbols: list[Int64],
    lacking: Float64,
    alive: Int64,
    limits: Sequence[tuple[slice, Float64]],
) -> list[Int64]:
    """Remove symbols that no Gaussian needs, starting with the finest level."""
    bindings = anchors.binding[:, alive]
    left = lacking - sum(level[:, bound] for level, bound in zip(symbols, bindings, strict=True))
    kept = [level.copy() for level in symbols]
    for level, bound in zip(kept, bindings, strict=True):
        for group, limit in limits:
            without = left[group] + level[group][:, bound]
            is_needed = np.zeros(level.shape[1], dtype=np.bool_)
            worse = (np.abs(without).max(axis=0) > limit) & (
                np.abs(left[group]).max(axis=0) <= limit
            )
            is_needed[bound[worse]] = True
            level[group] *= is_needed
            left[group] = without - level[group][:, bound]
    return kept
