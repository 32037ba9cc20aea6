"""Codes the new Gaussians of a frame relative to nearby parents: SPEC 7.6."""

import numpy as np

from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.scenes.rotations import Float64
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, LATTICE_OFFSET
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import Births, Gaussians

_REACH = 4  # number of neighbors on each side
_KEY_SHIFT = 3  # a lattice coordinate has 24 bits, a coordinate of a Morton key 21


def fit_births(updated: FrameState, target: Target, rows: Int64) -> tuple[Births | None, Int64]:
    """Return the births of a frame, and their rows of the target in the same order.

    Args:
        updated: State after motion and updates.
        target: The target frame.
        rows: `[n]` rows of the target that are new.

    Raises:
        EncodeError: A new Gaussian is too far from all others for the format.
    """
    if not rows.size:
        return None, rows
    positions = updated.scene.positions.astype(np.int64)
    parents = _find_parents(positions, target.positions[:, rows])
    order = np.argsort(parents, kind="stable")
    parents, rows = parents[order], rows[order]
    coded = target.coded(rows)
    apart = target.positions[:, rows] - positions[:, parents]
    places = np.rint(apart / target.header.position_step).astype(np.int64)
    if np.abs(places).max() > CODE_LIMIT:
        message = (
            f"a new Gaussian is more than {CODE_LIMIT} steps from all others: allow larger errors"
        )
        raise EncodeError(message)
    return Births(parents, Gaussians(places, coded.rotations, coded.codes)), rows


def _find_parents(positions: Int64, newborn: Float64) -> Int64:
    """Return `[n]` indices of nearby Gaussians: the nearest of some neighbors in Morton order."""
    keys = _keys(positions)
    order = np.argsort(keys, kind="stable")
    places = np.searchsorted(keys[order], _keys(np.rint(newborn).astype(np.int64)))
    candidates = order[np.clip(places + np.arange(-_REACH, _REACH)[:, None], 0, order.size - 1)]
    apart = np.abs(positions[:, candidates] - newborn[:, None, :]).max(axis=0)
    parents: Int64 = candidates[apart.argmin(axis=0), np.arange(newborn.shape[1])]
    return parents


def _keys(positions: Int64) -> Int64:
    return interleave((positions + LATTICE_OFFSET) >> _KEY_SHIFT)
