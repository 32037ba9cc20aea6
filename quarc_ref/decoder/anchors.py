"""Samples the anchors of a scene in integer arithmetic: SPEC 6.

An anchor is a Gaussian that is chosen to carry a residual. At each level, the Gaussian with
the lowest rank in every occupied cell of a grid is an anchor. Every Gaussian therefore has an
anchor in its own cell, which limits the search in `binding`. If the level needs more
anchors, the Gaussians with the lowest ranks among the others are added.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.binding import bind
from quarc_ref.decoder.philox import philox
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import LATTICE_BITS, LATTICE_OFFSET, PHILOX_DOMAIN_SAMPLER
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True, eq=False)
class AnchorLevel:
    """The anchors of one level, valid until the next sampling.

    Attributes:
        owners: `[a]` ids of the Gaussians that were chosen as anchors, ascending.
        positions: `[3, a]` positions of these Gaussians when they were chosen, lattice units.
        parents: `[a]` index of each anchor's parent in the next coarser
            level; all 0 at the coarsest level.
        cell_shift: Binary logarithm of the size of the cells in which `bind` searches; the
            default is a single cell.
    """

    owners: Int64
    positions: Int32
    parents: Int64
    cell_shift: int = LATTICE_BITS


@dataclass(frozen=True, slots=True, eq=False)
class Anchors:
    """All anchors of a frame, and the binding of its Gaussians to them.

    Attributes:
        levels: Anchors of each level, beginning with level 1, the finest.
        binding: `[L, N]` index of each Gaussian's anchor at each level.
    """

    levels: tuple[AnchorLevel, ...]
    binding: Int32

    def without(self, deleted_indices: Int64) -> "Anchors":
        """Return the anchors without the bindings of Gaussians at indices `[g]` (SPEC 6.5)."""
        return Anchors(self.levels, np.delete(self.binding, deleted_indices, axis=1))

    def with_births(self, positions: Int32) -> "Anchors":
        """Return the anchors with new Gaussians at positions `[3, n]` bound to them (SPEC 6.5)."""
        if positions.shape[1] == 0:
            return self
        newborn_binding = [
            bind(positions, level.positions, level.cell_shift) for level in self.levels
        ]
        return Anchors(
            self.levels, np.hstack([self.binding, np.array(newborn_binding, dtype=np.int32)])
        )


def count_anchors(gaussian_count: int, header: StreamHeader) -> tuple[int, ...]:
    """Return the number of anchors of each level, beginning with level 1 (SPEC 6.1)."""
    counts = [-(-gaussian_count // header.gaussians_per_anchor)]
    while len(counts) < header.level_count:
        counts.append(max(1, counts[-1] // header.anchor_ratio))
    return tuple(counts)


def sample_anchors(scene: Scene) -> Anchors:
    """Choose the anchors of a frame and bind every Gaussian to them (SPEC 6.2 to 6.5).

    Args:
        scene: Scene of the frame after its deaths (SPEC 7.4).
    """
    ranks = compute_ranks(scene)
    order, merge_shifts = _sort_by_cell(scene.positions)
    counts = count_anchors(scene.count, scene.header)
    binding = np.empty((len(counts), scene.count), dtype=np.int32)
    choices = []
    for level, count in enumerate(counts):
        indices, shift = _choose_anchors(ranks[level], order, merge_shifts, count)
        binding[level] = bind(scene.positions, scene.positions[:, indices], shift)
        choices.append((indices, shift))
    parents_by_level = [*binding[1:], np.zeros(scene.count, dtype=np.int32)]
    levels = []
    for (indices, shift), parents in zip(choices, parents_by_level, strict=True):
        owners, positions = scene.ids[indices], scene.positions[:, indices]
        levels.append(AnchorLevel(owners, positions, parents[indices].astype(int), shift))
    return Anchors(tuple(levels), binding)


def compute_ranks(scene: Scene) -> Int64:
    """Return the `[4, N]` ranks of the Gaussians; row k is for level k + 1 (SPEC 6.2).

    The high 32 bits of a rank are a pseudorandom word, and the low 32 bits are the id of the
    Gaussian. Subtracting 2^31 from the word makes ranks fit in int64 and preserves their order.
    """
    counter = np.zeros((4, scene.count), dtype=np.uint64)
    counter[0] = scene.ids
    counter[1] = scene.phase
    counter[3] = PHILOX_DOMAIN_SAMPLER
    words = philox(counter, scene.header.seed)
    return ((words - (1 << 31)) << 32) + scene.ids


def _sort_by_cell(positions: Int32) -> tuple[Int64, Int64]:
    """Sort Gaussians in Morton order, and find the smallest shift at which neighbors share a cell.

    A shift is the binary logarithm of a cell size. In Morton order, the Gaussians of a cell are
    contiguous at every shift, so a single sort finds the occupied cells for all shifts.

    Returns:
        The `[N]` indices of the Gaussians in Morton order; and for each of them, `[N]`, the
        smallest shift at which it shares a cell with the Gaussian before it. For the first
        Gaussian, this value is one more than the largest shift.
    """
    offset_positions = positions.astype(np.int64) + LATTICE_OFFSET
    high_keys, low_keys = (
        interleave(offset_positions >> _LOW_BIT_COUNT),
        interleave(offset_positions & ((1 << _LOW_BIT_COUNT) - 1)),
    )
    order = np.lexsort((low_keys, high_keys))
    high_keys, low_keys = high_keys[order], low_keys[order]
    high_lengths, low_lengths = (
        bit_length(high_keys[1:] ^ high_keys[:-1]),
        bit_length(low_keys[1:] ^ low_keys[:-1]),
    )
    shifts = np.where(
        high_lengths > 0, _LOW_BIT_COUNT + (high_lengths + 2) // 3, (low_lengths + 2) // 3
    )
    return order, np.concatenate([[LATTICE_BITS + 1], shifts])


def _choose_anchors(
    ranks: Int64, order: Int64, merge_shifts: Int64, count: int
) -> tuple[Int64, int]:
    """Return the ascending indices `[count]` and the cell shift of a level's anchors (SPEC 6.3)."""
    # Rule 1: a cell begins at each Gaussian that does not share the cell of its predecessor.
    cell_counts = merge_shifts.size - np.cumsum(
        np.bincount(merge_shifts, minlength=LATTICE_BITS + 1)
    )
    shift = int(np.argmax(cell_counts[: LATTICE_BITS + 1] <= count))
    starts = np.flatnonzero(merge_shifts > shift)
    # Rule 2: the Gaussian of lowest rank in every cell.
    is_anchor = np.isin(ranks, np.minimum.reduceat(ranks[order], starts))
    # Rule 3: the lowest ranks of all other Gaussians.
    indices_by_rank = np.argsort(ranks, kind="stable")
    additional_anchors = indices_by_rank[~is_anchor[indices_by_rank]][: count - starts.size]
    is_anchor[additional_anchors] = True
    return np.flatnonzero(is_anchor), shift


# Number of low bits of a 24-bit coordinate; keys of the low and of the high bits fit in 64 bits.
_LOW_BIT_COUNT = 8
