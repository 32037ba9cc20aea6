"""The paper's estimate of coded size: a zero-order Shannon estimate, to compare with real bytes.

For each channel of a frame, the sum of -log2 of every symbol's share: the
cost of an ideal coder that knows the shares for free. No decodable file has that
size; it is here for comparison with the literature (paper section 6).
"""

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.snapshot_planes import Snapshot, compare
from quarc_ref.format.records import Births, Gaussians
from quarc_ref.format.updates import UPDATE_FIELDS, Updates


def estimate_bits(channels: Int64) -> float:
    """Return the zero-order entropy of channels `[c, n]`, each with its own shares, bits."""
    bits = 0.0
    for channel in channels:
        _, counts = np.unique(channel, return_counts=True)
        bits -= float((counts * np.log2(counts / channel.size)).sum())
    return bits


def estimate_motion(symbols: tuple[Int64, ...]) -> float:
    """Return the estimated size of a frame's motion, bytes: 6 or 7 channels over all anchors."""
    return estimate_bits(np.concatenate(symbols, axis=1)) / 8


def estimate_updates(updates: Updates, count: int) -> float:
    """Return the estimated size of a frame's updates, bytes.

    Args:
        updates: Updates of the frame.
        count: Gaussians that might have been updated, which are a channel too; the others are
            who dies and, of each field, which Gaussians it changes and its numbers of these.
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
    """Return the estimated size of a canonical frame, bytes: a channel per number of a Gaussian."""
    rows = (gaussians.positions, gaussians.rotations, gaussians.codes)
    return estimate_bits(np.concatenate(rows)) / 8


def estimate_snapshot(snapshot: Snapshot, canonical: Gaussians) -> float:
    """Return the estimated size of a snapshot, bytes.

    Args:
        snapshot: The frame.
        canonical: Gaussians of its CANO: which of them are left is a channel, and each number of
            which they differ; the newborn are as those of a canonical frame.
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
    """Return the estimated size of a frame's births, bytes; parents are a channel as well."""
    newborn = births.newborn
    rows = (births.parents[None], newborn.positions, newborn.rotations, newborn.codes)
    return estimate_bits(np.concatenate(rows)) / 8
