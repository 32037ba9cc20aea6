"""The anchors of a scene, drawn by integers alone: SPEC 6.1 to 6.3.

An anchor is a Gaussian chosen to carry a residual. Of each level, every
occupied cell of a grid gives the Gaussian of least rank, and the least ranks
of the rest make up the number; so every Gaussian has an anchor in its own
cell, which bounds the search of `binding`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from quarc_ref.decoder.anchor_trees import AnchorTree, CompiledSampler, Drawn, bind_through
from quarc_ref.decoder.binding import bind, bind_exhaustively
from quarc_ref.decoder.philox import philox
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.acceleration import Wait, load_kernels, settled
from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import LATTICE_BITS, LATTICE_OFFSET, PHILOX_DOMAIN_SAMPLER
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True, eq=False)
class AnchorLevel:
    """The anchors of one level, from one sampling to the next.

    Attributes:
        owners: `[a]` ids of the Gaussians that were chosen, ascending.
        positions: `[3, a]` where they were when chosen, lattice units.
        parents: `[a]` index of each anchor's parent in the next coarser
            level; zeros at the coarsest.
        tree: What finds the nearest of them fast; None where plain NumPy does.
    """

    owners: Int64
    positions: Int32
    parents: Int64
    tree: AnchorTree | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Anchors:
    """All anchors of a frame and who follows them.

    Attributes:
        levels: Level 1, the finest, first.
        binding: `[L, N]` index of each Gaussian's anchor at each level.
        wait: Is called before the binding is read, which other threads may still write.
    """

    levels: tuple[AnchorLevel, ...]
    binding: Int32
    wait: Wait = settled


def count_anchors(gaussian_count: int, header: StreamHeader) -> tuple[int, ...]:
    """Return the number of anchors of each level, level 1 first (SPEC 6.1)."""
    counts = [-(-gaussian_count // header.gaussians_per_anchor)]
    while len(counts) < header.level_count:
        counts.append(max(1, counts[-1] // header.anchor_ratio))
    return tuple(counts)


def sample_anchors(scene: Scene) -> Anchors:
    """Choose the anchors of a frame and bind every Gaussian to them.

    Args:
        scene: Of the frame, its dead gone.

    Returns:
        The anchors; see `Anchors.wait`.
    """
    drawn, binding, wait = _choose_sampler(scene).sample(count_anchors(scene.count, scene.header))
    levels = []
    for number, (chosen, tree) in enumerate(drawn):
        parents = np.zeros(chosen.size, dtype=np.int64)
        if number + 1 < len(drawn):
            parents[:] = binding[number + 1, chosen]
        positions = scene.positions.take(chosen, axis=1)
        levels.append(AnchorLevel(scene.ids[chosen], positions, parents, tree))
    return Anchors(tuple(levels), binding, wait)


def bind_newborn(level: AnchorLevel, positions: Int32) -> Int64:
    """Return the indices `[n]` of the anchors that Gaussians born since the sampling follow."""
    if level.tree is not None:
        kernels = load_kernels(_BINDING, level.owners.size)
        if kernels is not None:
            return bind_through(level.tree, positions, kernels)
    return bind_exhaustively(positions, level.positions)


class _Sampler(Protocol):
    """Samples the levels of a scene."""

    def sample(self, counts: tuple[int, ...]) -> tuple[list[Drawn], Int32, Wait]:
        """Sample all levels, level 1 first.

        Args:
            counts: How many anchors each is to have.

        Returns:
            What was drawn of each level, the binding `[L, N]`, and what waits for it;
            all but that of level 1 is there.
        """
        ...


class PlainSampler:
    """SPEC 6.2 to 6.4 in NumPy; see `_Sampler`."""

    def __init__(self, scene: Scene) -> None:
        self._positions = scene.positions
        self._ranks = _rank(scene)
        self._order, self._merges = _sort_cells(scene.positions)

    def sample(self, counts: tuple[int, ...]) -> tuple[list[Drawn], Int32, Wait]:
        """See `_Sampler.sample`."""
        drawn: list[Drawn] = []
        binding = np.empty((len(counts), self._positions.shape[1]), dtype=np.int32)
        for level, count in enumerate(counts):
            chosen, shift = _choose(self._ranks[level], self._order, self._merges, count)
            binding[level] = bind(self._positions, self._positions[:, chosen], shift)
            drawn.append((chosen, None))
        return drawn, binding, settled


def _choose_sampler(scene: Scene) -> _Sampler:
    modules = [load_kernels(name, scene.count) for name in (_SAMPLING, _TREE, _BINDING)]
    loaded = [module for module in modules if module is not None]
    return CompiledSampler(scene, *loaded) if len(loaded) == len(modules) else PlainSampler(scene)


def _rank(scene: Scene) -> Int64:
    """Return `[4, N]` the rank of each Gaussian at each level: (word, id) as one number.

    A word is 32 bits and an id 32, so that a rank fits 64 only as an unsigned
    number; halving the words' range by an offset keeps the order in int64.
    """
    counter = np.zeros((4, scene.count), dtype=np.uint64)
    counter[0] = scene.ids
    counter[1] = scene.phase
    counter[3] = PHILOX_DOMAIN_SAMPLER
    words = philox(counter, scene.header.seed)
    return ((words - (1 << 31)) << 32) + scene.ids


def _sort_cells(positions: Int32) -> tuple[Int64, Int64]:
    """Return the Gaussians in Morton order, and when each joins its predecessor.

    Returns:
        `[N]` indices in Morton order, and `[N]` the least shift at which each
        is in the cell of the one before it (one more than any for the first).
    """
    biased = positions.astype(np.int64) + LATTICE_OFFSET
    high, low = interleave(biased >> _LOW_BITS), interleave(biased & ((1 << _LOW_BITS) - 1))
    order = np.lexsort((low, high))
    high, low = high[order], low[order]
    upper, lower = bit_length(high[1:] ^ high[:-1]), bit_length(low[1:] ^ low[:-1])
    axis_bits = np.where(upper > 0, _LOW_BITS + (upper + 2) // 3, (lower + 2) // 3)
    return order, np.concatenate([[LATTICE_BITS + 1], axis_bits])


def _choose(rank: Int64, order: Int64, merges: Int64, count: int) -> tuple[Int64, int]:
    """Return the indices `[count]` of a level's anchors, ascending, and its shift."""
    occupied = merges.size - np.cumsum(np.bincount(merges, minlength=LATTICE_BITS + 1))
    shift = int(np.argmax(occupied[: LATTICE_BITS + 1] <= count))
    starts = np.flatnonzero(merges > shift)
    least = np.minimum.reduceat(rank[order], starts)
    ranked = np.argsort(rank, kind="stable")
    chosen = np.isin(rank, least)
    rest = ranked[~chosen[ranked]][: count - starts.size]
    chosen[rest] = True
    return np.flatnonzero(chosen), shift


_LOW_BITS = 8
_SAMPLING = "quarc_ref.decoder.sampling_kernels"
_TREE = "quarc_ref.decoder.tree_kernels"
_BINDING = "quarc_ref.decoder.binding_kernels"
