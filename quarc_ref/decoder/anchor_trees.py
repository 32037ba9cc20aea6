"""The sampler and the binding, compiled: what SPEC 6.2 to 6.4 say, by way of Morton order.

Gaussians are sorted once for all levels. The anchors of a level, a subset of
them, inherit that order, so that a tree of boxes over them takes no further
sorting; it is kept for the newborn of the frames until the next sampling.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from quarc_ref.decoder.scene import Scene
from quarc_ref.format.acceleration import count_threads, map_parts
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import PHILOX_DOMAIN_SAMPLER

# Where the parts of each run begin, and the boxes `[r, 6]` of the runs.
Runs = tuple[Int32, Int32]

_GAUSSIANS_OF_RUNS = (16, 64, 256, 1024)
_ANCHORS_OF_BLOCKS = (16, 256, 4096)
_PARTS_OF_A_THREAD = 4


@dataclass(frozen=True, slots=True, eq=False)
class AnchorTree:
    """The anchors of a level in Morton order, of those at one place the first alone.

    Attributes:
        anchors: `[b, 4]` xyz and number.
        blocks: Runs of runs of them, the widest first.
    """

    anchors: Int32
    blocks: tuple[Runs, ...]


class CompiledSampler:
    """Draws and binds level by level; see `anchors.PlainSampler`.

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
        self._words = drawing.draw_words(scene.ids, scene.phase, seed, PHILOX_DOMAIN_SAMPLER)
        self._order, self._merges = drawing.sort_cells(scene.positions)
        self._points = growing.list_points(scene.positions, self._order)
        self._runs = self._make_tree(self._points, self._merges, _GAUSSIANS_OF_RUNS)

    def sample(self, level: int, count: int) -> tuple[Int64, Int64, AnchorTree]:
        """Return indices of the anchors, the binding, and the tree of the anchors."""
        kernels = self._growing
        flags = self._drawing.choose(self._words[level], self._order, self._merges, count)
        anchors, merges, ranks = kernels.list_anchors(
            flags, self._order, self._merges, self._points
        )
        places = np.ascontiguousarray(anchors[:, :3].T)
        tree = AnchorTree(anchors, self._make_tree(places, merges, _ANCHORS_OF_BLOCKS))
        return np.flatnonzero(flags), self._bind(tree, ranks), tree

    def _bind(self, tree: AnchorTree, ranks: Int32) -> Int64:
        binding = np.empty(self._order.size, dtype=np.int64)
        tops = self._runs[0][0].size - 1
        parts = min(tops, _PARTS_OF_A_THREAD * count_threads())
        borders = [tops * part // parts for part in range(parts + 1)]

        def bind_part(part: int) -> None:
            self._binding.bind_runs(
                (self._points, self._order, self._runs),
                (tree.anchors, ranks, tree.blocks),
                (borders[part], borders[part + 1]),
                binding,
            )

        map_parts(bind_part, range(parts))
        return binding

    def _make_tree(self, points: Int32, merges: Int32, sizes: tuple[int, ...]) -> tuple[Runs, ...]:
        """Return runs of runs of points in Morton order, the widest first."""
        kernels = self._growing
        begins = np.arange(merges.size + 1, dtype=np.int32)
        starts = kernels.cut_runs(merges, begins, sizes[0])
        runs = [(starts, kernels.bound_points(points, starts))]
        for size in sizes[1:]:
            begins = begins[starts]
            starts = kernels.cut_runs(merges, begins, size)
            runs.append((starts, kernels.bound_boxes(runs[-1][1], starts)))
        return tuple(reversed(runs))


def bind_through(tree: AnchorTree, positions: Int32, kernels: ModuleType) -> Int64:
    """Return the index of the nearest anchor of every Gaussian, `[n]`.

    Args:
        tree: Of the level's anchors.
        positions: `[3, n]` lattice units.
        kernels: Those of `binding_kernels`.
    """
    answers: Int64 = kernels.bind_points(np.ascontiguousarray(positions), tree.anchors, tree.blocks)
    return answers
