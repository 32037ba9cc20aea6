"""Codes the new Gaussians of a frame relative to nearby parents (SPEC 7.6)."""

import numpy as np

from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.rotations import Float64
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, LATTICE_OFFSET
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import Births, Gaussians

_NEIGHBORS_PER_SIDE = 4  # number of neighbors on each side
_KEY_SHIFT = 3  # lattice coordinates have 24 bits; coordinates of Morton keys have 21


def fit_births(
    updated_state: FrameState, target: Target, rows: Int64
) -> tuple[Births | None, Int64]:
    """Return the births of a frame, and the target row of each birth in the same order.

    Args:
        updated_state: State after motion and updates.
        target: Gaussians that the frame approximates.
        rows: `[n]` rows of the target that the frame adds.

    Raises:
        EncodeError: A new Gaussian is farther from its parent than the format allows.
    """
    if not rows.size:
        return None, rows
    positions = updated_state.scene.positions.astype(np.int64)
    parents = _find_parents(positions, target.positions[:, rows])
    order = np.argsort(parents, kind="stable")
    parents, rows = parents[order], rows[order]
    gaussians = target.quantized(rows)
    offsets = target.positions[:, rows] - positions[:, parents]
    offset_steps = np.rint(offsets / target.header.position_step).astype(np.int64)
    if np.abs(offset_steps).max() > CODE_LIMIT:
        message = (
            f"a new Gaussian is more than {CODE_LIMIT} steps from its parent: allow larger errors"
        )
        raise EncodeError(message)
    return Births(parents, Gaussians(offset_steps, gaussians.rotations, gaussians.codes)), rows


def _find_parents(positions: Int64, new_positions: Float64) -> Int64:
    """Return the `[n]` indices of parents, each the nearest of 8 neighbors in Morton order."""
    morton_keys = _compute_morton_keys(positions)
    order = np.argsort(morton_keys, kind="stable")
    insertion_points = np.searchsorted(
        morton_keys[order], _compute_morton_keys(np.rint(new_positions).astype(np.int64))
    )
    candidates = order[
        np.clip(
            insertion_points + np.arange(-_NEIGHBORS_PER_SIDE, _NEIGHBORS_PER_SIDE)[:, None],
            0,
            order.size - 1,
        )
    ]
    distances = np.abs(positions[:, candidates] - new_positions[:, None, :]).max(axis=0)
    parents: Int64 = candidates[distances.argmin(axis=0), np.arange(new_positions.shape[1])]
    return parents


def _compute_morton_keys(positions: Int64) -> Int64:
    return interleave((positions + LATTICE_OFFSET) >> _KEY_SHIFT)
