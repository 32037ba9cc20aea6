"""The dead zone of snapshots: small moves since the canonical frame are undone.

A snapshot is the state from which decoding continues, so the encoder may choose it. Many
Gaussians have drifted by a step or two, which costs bytes in a snapshot but does not
change the picture (docs/experiments/what-moves.md). Codes of scale, opacity and color have
no dead zone, because undoing their smallest changes is visible.
"""

import numpy as np

from quarc_ref.format.arithmetic import divide_round
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.records import Gaussians, StreamHeader


def undo_small_moves(
    gaussians: Gaussians, canonical: Gaussians, roots: Int64, header: StreamHeader, steps: int
) -> Gaussians:
    """Return the Gaussians of a snapshot after undoing moves within the dead zone.

    A position returns to that of the canonical frame if it differs by at most `steps`
    translation steps on every axis; a rotation if its coded components differ by at most
    `steps` units of 2^-`rotation_bits` each.

    Args:
        gaussians: Gaussians on the grid of canonical frames.
        canonical: Gaussians of the last canonical frame (CANO), in its order.
        roots: `[N]` index of each Gaussian in the CANO; -1 for new ones.
        header: Header of the stream.
        steps: Size of the dead zone; 0 for none.
    """
    (known,) = np.nonzero(roots >= 0)
    reach = divide_round(np.array(steps * header.translation_step), header.position_step).item()
    positions, rotations = gaussians.positions.copy(), gaussians.rotations.copy()
    for rows, before, limits in (
        (positions, canonical.positions, (reach,) * 3),
        (rotations, canonical.rotations, (0, steps, steps, steps)),
    ):
        near = known[_differ_little(rows[:, known], before[:, roots[known]], limits)]
        rows[:, near] = before[:, roots[near]]
    return Gaussians(positions, rotations, gaussians.codes)


def _differ_little(rows: Int64, before: Int64, limits: tuple[int, ...]) -> Bits:
    """Return a mask of the columns in which no row differs by more than its limit."""
    near: Bits = np.all(np.abs(rows - before) <= np.array(limits)[:, None], axis=0)
    return near
