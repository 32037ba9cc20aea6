"""The dead zone of snapshots: a snapshot undoes small moves since the canonical frame.

Later frames are decoded from the state in the snapshot, so the encoder may change this state.
Many Gaussians have drifted by a step or two since the canonical frame. Coding this drift costs
bytes but has no visible effect (docs/experiments/what-moves.md). Codes of scale, opacity and color
have no dead zone, because undoing even their smallest changes would be visible.
"""

import numpy as np

from quarc_ref.format.arithmetic import divide_round
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.records import Gaussians, StreamHeader


def undo_small_moves(
    gaussians: Gaussians,
    canonical: Gaussians,
    canonical_indices: Int64,
    header: StreamHeader,
    max_steps: int,
) -> Gaussians:
    """Return the Gaussians of a snapshot after undoing moves within the dead zone.

    A position is reset to its value in the canonical frame if the two differ by at most `max_steps`
    translation steps, rounded to position steps, on every axis. A rotation is reset if each coded
    component differs from its value in the canonical frame by at most `max_steps` units of
    2^-`rotation_bits`.

    Args:
        gaussians: Gaussians of the snapshot, on the grid of canonical frames.
        canonical: Gaussians of the last canonical frame (CANO), in the order of the chunk.
        canonical_indices: `[N]` index of each Gaussian in `canonical`; -1 for Gaussians that
            were added later.
        header: Header of the stream.
        max_steps: Size of the dead zone in steps; 0: no dead zone.
    """
    (survivor_indices,) = np.nonzero(canonical_indices >= 0)
    position_limit = divide_round(
        np.array(max_steps * header.translation_step), header.position_step
    ).item()
    positions, rotations = gaussians.positions.copy(), gaussians.rotations.copy()
    for values, canonical_values, limits in (
        (positions, canonical.positions, (position_limit,) * 3),
        (rotations, canonical.rotations, (0, max_steps, max_steps, max_steps)),
    ):
        undone_indices = survivor_indices[
            _find_small_changes(
                values[:, survivor_indices],
                canonical_values[:, canonical_indices[survivor_indices]],
                limits,
            )
        ]
        values[:, undone_indices] = canonical_values[:, canonical_indices[undone_indices]]
    return Gaussians(positions, rotations, gaussians.codes)


def _find_small_changes(rows: Int64, canonical_rows: Int64, limits: tuple[int, ...]) -> Bits:
    """Return a mask of the columns in which no row differs by more than the row's limit."""
    is_small: Bits = np.all(np.abs(rows - canonical_rows) <= np.array(limits)[:, None], axis=0)
    return is_small
