"""The paper's estimate of coded size: the zero-order entropy of the symbols.

For each channel of a frame, it is the sum of -log2 of every symbol's frequency, which is
the cost of an ideal coder that knows the frequencies. No decodable file has this size;
the estimate is for comparison with the literature (paper section 6).
"""

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.snapshot_planes import Snapshot, compare
from quarc_ref.format.records import Births, Gaussians
from quarc_ref.format.updates import UPDATE_FIELDS, Updates


def estimate_bits(channels: Int64) -> float:
    """Return the zero-order entropy of channels `[c, n]` in bits, with frequencies per channel."""
    bits = 0.0
    for channel in channels:
        _, counts = np.unique(channel, return_counts=True)
        bits -= float((counts * np.log2(counts / channel.size)).sum())
    return bits


def estimate_motion(symbols: tuple[Int64, ...]) -> float:
    """Return the estimated bytes of a frame's motion: 6 or 7 channels over all anchors."""
    return estimate_bits(np.concatenate(symbols, axis=1)) / 8


def estimate_updates(updates: Updates, count: int) -> float:
    """Return the estimated bytes of a frame's updates.

    The channels are a flag per Gaussian whether it changes, a flag per changed Gaussian
    whether it is deleted, and for each field a flag whether the field changes, and its
    residuals.

    Args:
        updates: Updates of the frame.
        count: Number of Gaussians.
    """
    chosen = np.zeros(count, dtype=np.int64)
    chosen[updates.gaussians] = 1
    bits = estimate_bits(chosen[None])
    if updates.count:
        bits += estimate_bits(updates.dies[None].astype(np.int64))
    for rows in UPDATE_FIELDS.values():
        values = updates.residuals[rows][:, ~updates.dies]
        there = np.any(values, axis=0)
        if there.any():
            bits += estimate_bits(there[None].astype(np.int64)) + estimate_bits(values[:, there])
    return bits / 8


def estimate_gaussians(gaussians: Gaussians) -> float:
    """Return the estimated bytes of a canonical frame: one channel per number of a Gaussian."""
    rows = (gaussians.positions, gaussians.rotations, gaussians.codes)
    return estimate_bits(np.concatenate(rows)) / 8


def estimate_snapshot(snapshot: Snapshot, canonical: Gaussians) -> float:
    """Return the estimated bytes of a snapshot.

    The channels are a flag per Gaussian of the CANO whether it remains, and the difference
    of each of its numbers. New Gaussians are estimated as in a canonical frame.

    Args:
        snapshot: The frame.
        canonical: Gaussians of its CANO.
    """
    lives = np.zeros((1, canonical.count), dtype=np.int64)
    lives[0, snapshot.roots[snapshot.roots >= 0]] = 1
    bits = estimate_bits(lives) + estimate_bits(compare(snapshot, canonical))
    born, gaussians = snapshot.roots < 0, snapshot.gaussians
    if born.any():
        rows = (gaussians.positions, gaussians.rotations, gaussians.codes)
        bits += estimate_bits(np.concatenate(rows)[:, born])
    return bits / 8


def estimate_births(births: Births) -> float:
    """Return the estimated bytes of a frame's births, with parents as an additional channel."""
    newborn = births.newborn
    rows = (births.parents[None], newborn.positions, newborn.rotations, newborn.codes)
    return estimate_bits(np.concatenate(rows)) / 8
