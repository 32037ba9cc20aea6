"""The sampler and the binding, compiled: what SPEC 6.2 to 6.4 say, by way of Morton order.

Gaussians are sorted once for all levels. The anchors of a level, a subset of
them, inherit that order, so that a tree of boxes over them takes no further
sorting; it is kept for the newborn of the frames until the next sampling.
"""

import itertools
from dataclasses import dataclass
from functools import partial
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.scene import Scene
from quarc_ref.format.acceleration import Wait, count_threads, start_parts
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import PHILOX_DOMAIN_SAMPLER

# Where the parts of each run begin, and the boxes `[r, 6]` of the runs.
Runs = tuple[Int32, Int32]

_GAUSSIANS_OF_RUNS = (64, 256, 1024)
_ANCHORS_OF_BLOCKS = (16, 256, 4096)
_PARTS_OF_A_THREAD = 4


@dataclass(frozen=True, slots=True, eq=False)
class AnchorTree:
    """The anchors of a level in Morton order, of those at one place the first alone.

    Attributes:
        anchors: `[4, b + 16]` xyz and number; the last 16 mean nothing.
        blocks: `[b, 8]` blocks of blocks of them, the widest first: see `pruning_kernels`.
        widest: How many blocks are of the widest.
    """

    anchors: Int32
    blocks: Int32
    widest: int


# Of a level: indices `[a]` of the Gaussians that are its anchors, ascending; and what
# finds the nearest of them fast, if anything.
Drawn = tuple[Int64, AnchorTree | None]

# The same, and `[N + 1]` how many of them stand before each Gaussian in Morton order.
_Found = tuple[Int64, AnchorTree, Int32]


class CompiledSampler:
    """Draws and binds all levels; see `anchors.PlainSampler`.

    Args:
        scene: Whose Gaussians are sampled.
        drawing: The kernels of `sampling_kernels`.
        growing: Those of `tree_kernels`.
        binding: Those of `binding_kernels`.
    """

    def __init__(
        self, scene: Scene, drawing: ModuleType, growing: ModuleType, binding: ModuleType
    ) -> None:
        self._drawing, self._growing, self._binding = drawing, growing, binding
        seed = np.uint64(scene.header.seed)
        self._order, self._merges = order, merges = drawing.sort_cells(scene.positions)
        list_points = partial(growing.list_points, scene.positions, order)
        count_merges = partial(np.bincount, merges, minlength=drawing.MERGES)
        wait = start_parts(lambda work: work(), (list_points, count_merges))
        self._words = drawing.draw_words(scene.ids, order, scene.phase, seed, PHILOX_DOMAIN_SAMPLER)
        self._points, self._joined = wait()

    def sample(self, counts: tuple[int, ...]) -> tuple[list[Drawn], Int32, Wait]:
        """Sample all levels, level 1 first.

        Returns:
            What was drawn of every level, the binding `[L, N]`, and what waits for that of
            level 1: no parent of an anchor is found through it.
        """
        finest, *others = range(len(counts))
        draw = {
            level: start_parts(lambda level: self._draw(level, counts[level]), [level])
            for level in (*others[::-1], finest)
        }
        gaussians = _walk_runs(self._make_tree(self._points, self._merges, _GAUSSIANS_OF_RUNS))
        binding = np.empty((len(counts), self._order.size), dtype=np.int32)
        drawn: dict[int, _Found] = {}
        waits = []
        # The coarsest is there by now. Level 1 takes longest, and is what nobody has begun.
        for level in (*others[-1:], finest, *others[:-1]):
            (drawn[level],) = draw[level]()
            if level != finest:
                waits.append(self._start_binding(drawn[level], gaussians, binding[level]))
        wait_for_finest = self._start_binding(drawn[finest], gaussians, binding[finest])
        for wait in reversed(waits):  # the others begin with the first
            wait()
        found = [drawn[level] for level in range(len(counts))]
        return [(indices, tree) for indices, tree, _ in found], binding, wait_for_finest

    def _draw(self, level: int, count: int) -> _Found:
        """Draw the anchors of a level."""
        chosen = self._drawing.choose(
            self._words[level], self._order, self._merges, self._joined, count
        )
        indices, anchors, merges, ranks = self._growing.list_anchors(
            chosen, self._order, self._merges, self._points, count
        )
        runs = self._make_tree(anchors, merges, _ANCHORS_OF_BLOCKS)
        return indices, AnchorTree(anchors, _stack_blocks(runs), len(runs[0][1])), ranks

    def _start_binding(self, found: _Found, walk: tuple[Int32, Int64], binding: Int32) -> Wait:
        """Begin to write the binding `[N]` of a level; see `start_parts`."""
        runs, tops = walk
        _, tree, ranks = found
        gaussians = (self._points, self._order, runs)
        anchors = (tree.anchors, ranks, tree.blocks, tree.widest)
        parts = min(tops.size - 1, _PARTS_OF_A_THREAD * count_threads())
        borders = tops[np.arange(parts + 1) * (tops.size - 1) // parts].tolist()

        def bind_part(span: tuple[int, int]) -> None:
            room = _make_room(self._binding, len(tree.blocks), span[1] - span[0])
            self._binding.bind_runs(gaussians, anchors, span, room, binding)

        return start_parts(bind_part, list(itertools.pairwise(borders)))

    def _make_tree(self, points: Int32, merges: Int32, sizes: tuple[int, ...]) -> list[Runs]:
        """Return runs of runs of points in Morton order, the widest first."""
        kernels = self._growing
        begins = np.arange(merges.size + 1, dtype=np.int32)
        starts = kernels.cut_runs(merges, begins, sizes[0])
        runs = [(starts, kernels.bound_points(points, starts))]
        for size in sizes[1:]:
            begins = begins[starts]
            starts = kernels.cut_runs(merges, begins, size)
            runs.append((starts, kernels.bound_boxes(runs[-1][1], starts)))
        return runs[::-1]


def _walk_runs(runs: list[Runs]) -> tuple[Int32, Int64]:
    """Return runs `[r, 9]`, each before its parts: box, depth, first point, last and one.

    Returns:
        The runs, and `[t + 1]` where the largest stand, and the end.
    """
    rows, borders = [], runs[-1][0]
    for depth in reversed(range(len(runs))):
        boxes = runs[depth][1]
        depths = np.full(len(boxes), depth, dtype=np.int32)
        rows.append(np.column_stack([boxes, depths, borders[:-1], borders[1:]]))
        if depth:
            borders = borders[runs[depth - 1][0]]
    walk = np.concatenate(rows[::-1])
    walk = walk[np.argsort(walk[:, 7], kind="stable")]
    return walk, np.append(np.flatnonzero(walk[:, 6] == 0), len(walk))


def _stack_blocks(runs: list[Runs]) -> Int32:
    """Return `[b, 8]` all runs: box, first part, last and one; of the least size, anchors."""
    rows, first = [], 0
    for starts, boxes in runs[:-1]:
        first += len(boxes)
        rows.append(np.column_stack([boxes, starts[:-1] + first, starts[1:] + first]))
    starts, boxes = runs[-1]
    rows.append(np.column_stack([boxes, starts[:-1], starts[1:]]))
    return np.concatenate(rows).astype(np.int32)


def bind_through(tree: AnchorTree, positions: Int32, kernels: ModuleType) -> Int64:
    """Return the index of the nearest anchor of every Gaussian, `[n]`.

    Args:
        tree: Of the level's anchors.
        positions: `[3, n]` lattice units.
        kernels: Those of `binding_kernels`.
    """
    answers = np.empty(positions.shape[1], dtype=np.int64)
    lists = np.empty((2, len(tree.blocks)), dtype=np.uint32)
    points, anchors = np.ascontiguousarray(positions), (tree.anchors, tree.blocks, tree.widest)
    kernels.bind_points(points, anchors, lists, answers)
    return answers


def _make_room(kernels: ModuleType, blocks: int, runs: int) -> tuple[NDArray[np.generic], ...]:
    """Return what `pruning_kernels` works in."""
    return (
        np.empty((kernels.LISTS + 1, blocks), dtype=np.uint32),
        np.empty((kernels.LISTS, 4, kernels.MOST), dtype=np.int32),
        np.empty((2, kernels.LISTS), dtype=np.int64),
        np.empty(kernels.RUN, dtype=np.uint8),
        np.empty((2, kernels.RUN), dtype=np.int64),
        np.empty((2, kernels.RUN), dtype=np.int32),
        np.empty(runs, dtype=np.int64),
        np.empty(kernels.RUN, dtype=kernels.NEARLY),
    )
