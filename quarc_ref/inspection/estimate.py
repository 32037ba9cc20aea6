"""The paper's estimate of the coded size: the zero-order entropy of the symbols.

For each channel of a frame, the estimate is the sum of -log2 of every symbol's relative
frequency: the cost of an ideal coder that knows the frequencies. The estimate is not the size of
any decodable file; it serves only for comparison with the literature (section 6 of the paper).
"""

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.snapshot_planes import Snapshot, compute_differences
from quarc_ref.format.records import Births, Gaussians
from quarc_ref.format.updates import UPDATE_FIELDS, Updates


def estimate_bits(channels: Int64) -> float:
    """Return the sum of the zero-order entropies of channels `[c, n]`, in bits."""
    bits = 0.0
    for channel in channels:
        _, counts = np.unique(channel, return_counts=True)
        bits -= float((counts * np.log2(counts / channel.size)).sum())
    return bits


def estimate_motion(symbols: tuple[Int64, ...]) -> float:
    """Return the estimated bytes of a frame's motion, with 6 or 7 channels over all anchors."""
    return estimate_bits(np.concatenate(symbols, axis=1)) / 8


def estimate_updates(updates: Updates, gaussian_count: int) -> float:
    """Return the estimated bytes of a frame's updates.

    One channel states which Gaussians change, and another states which of these are deleted. For
    each field, one channel states in which of the remaining Gaussians it changes, and one channel
    per row contains the residuals.

    Args:
        updates: Updates of the frame.
        gaussian_count: Number of Gaussians before the updates.
    """
    changes = np.zeros(gaussian_count, dtype=np.int64)
    changes[updates.gaussians] = 1
    bits = estimate_bits(changes[None])
    if updates.count:
        bits += estimate_bits(updates.dies[None].astype(np.int64))
    for rows in UPDATE_FIELDS.values():
        values = updates.residuals[rows][:, ~updates.dies]
        has_residual = np.any(values, axis=0)
        if has_residual.any():
            bits += estimate_bits(has_residual[None].astype(np.int64)) + estimate_bits(
                values[:, has_residual]
            )
    return bits / 8


def estimate_gaussians(gaussians: Gaussians) -> float:
    """Return the estimated bytes of a canonical frame, with one channel per row of its arrays."""
    rows = (gaussians.positions, gaussians.rotations, gaussians.codes)
    return estimate_bits(np.concatenate(rows)) / 8


def estimate_snapshot(snapshot: Snapshot, canonical: Gaussians) -> float:
    """Return the estimated bytes of a snapshot.

    One channel states which Gaussians of the CANO survive; the other channels contain the
    differences of the survivors. New Gaussians are estimated as in a canonical frame.

    Args:
        snapshot: The decoded snapshot.
        canonical: Gaussians of the CANO to which the snapshot refers.
    """
    survives = np.zeros((1, canonical.count), dtype=np.int64)
    survives[0, snapshot.canonical_indices[snapshot.canonical_indices >= 0]] = 1
    bits = estimate_bits(survives) + estimate_bits(compute_differences(snapshot, canonical))
    is_new, gaussians = snapshot.canonical_indices < 0, snapshot.gaussians
    if is_new.any():
        rows = (gaussians.positions, gaussians.rotations, gaussians.codes)
        bits += estimate_bits(np.concatenate(rows)[:, is_new])
    return bits / 8


def estimate_births(births: Births) -> float:
    """Return the estimated bytes of a frame's births, with parents as an additional channel."""
    newborn = births.newborn
    rows = (births.parents[None], newborn.positions, newborn.rotations, newborn.codes)
    return estimate_bits(np.concatenate(rows)) / 8
