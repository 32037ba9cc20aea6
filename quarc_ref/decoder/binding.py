"""Finds the exact nearest anchor of every Gaussian: SPEC 6.4.

Among equally near anchors, the one with the lowest index is chosen. A grid limits the search:
the anchors in a Gaussian's own cell give an upper bound on the distance, and neighboring cells
are searched only if they are no farther away than this bound. A Gaussian whose bound extends
beyond the 26 neighboring cells is compared with every anchor.
"""

from itertools import product

import numpy as np

from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import LATTICE_OFFSET

_MIN_SHIFT = 4
_MAX_PAIRS_PER_BATCH = 1 << 20
_INT64_MAX = np.iinfo(np.int64).max


def bind(positions: Int32, anchors: Int32, shift: int) -> Int64:
    """Return the index of the nearest anchor of every Gaussian.

    Args:
        positions: `[3, N]` positions of the Gaussians, lattice units.
        anchors: `[3, A]` positions of the anchors, lattice units; A is at least 1.
        shift: Binary logarithm of the cell size. It affects only the speed, which is highest
            with about one anchor per cell.

    Returns:
        `[N]` anchor indices; among equally near anchors, the lowest index.
    """
    unique_anchors = _first_anchor_at_each_position(anchors)
    anchors = anchors[:, unique_anchors]
    search = _CellSearch(positions, anchors, max(shift, _MIN_SHIFT))
    for cell_offset in _CELL_OFFSETS:
        search.compare_cell(np.array(cell_offset, dtype=np.int64))
    may_be_nearer = search.squared_distances_outside() <= search.squared_distances
    uncertain = np.flatnonzero(may_be_nearer)
    search.nearest[uncertain] = bind_exhaustively(positions[:, uncertain], anchors)
    return unique_anchors[search.nearest]


def bind_exhaustively(positions: Int32, anchors: Int32) -> Int64:
    """Return the same result as `bind` by comparing every Gaussian with every anchor."""
    nearest = np.zeros(positions.shape[1], dtype=np.int64)
    batch_size = max(1, _MAX_PAIRS_PER_BATCH // anchors.shape[1])
    for start in range(0, nearest.size, batch_size):
        batch = positions[:, start : start + batch_size, None].astype(np.int64)
        distances = _squared_lengths(batch - anchors[:, None, :])
        nearest[start : start + batch_size] = distances.argmin(axis=1)
    return nearest


def _first_anchor_at_each_position(anchors: Int32) -> Int64:
    """Return the indices, ascending, of the first anchor at each position.

    If several anchors are at the same position, only the first can be the result of `bind`. A
    stream of a few bytes can have all its anchors at one position, and comparing every Gaussian
    with all these anchors would take minutes.
    """
    order = np.lexsort(anchors)  # stable: indices at the same position stay in order
    differs_from_previous = np.any(np.diff(anchors[:, order], axis=1), axis=0)
    return np.sort(order[np.append(True, differs_from_previous)])


class _CellSearch:
    """Anchors sorted by cell, and the nearest anchor found so far for every Gaussian."""

    def __init__(self, positions: Int32, anchors: Int32, shift: int) -> None:
        self._positions = positions.astype(np.int64) + LATTICE_OFFSET
        self._cells = self._positions >> shift
        self._shift = shift
        keys = _cell_keys(anchors.astype(np.int64) + LATTICE_OFFSET >> shift)
        self._order = np.argsort(keys, kind="stable")
        self._anchors = anchors.astype(np.int64)[:, self._order] + LATTICE_OFFSET
        self._keys = keys[self._order]
        self.nearest = np.zeros(positions.shape[1], dtype=np.int64)
        self.squared_distances = np.full(positions.shape[1], _INT64_MAX)

    def compare_cell(self, cell_offset: Int64) -> None:
        """Compare every Gaussian with the anchors in the cell at `cell_offset` from its own."""
        cells = self._cells + cell_offset[:, None]
        gaussians = np.flatnonzero(self._squared_distances_to(cells) <= self.squared_distances)
        keys = _cell_keys(cells[:, gaussians])
        starts = np.searchsorted(self._keys, keys, side="left")
        counts = np.searchsorted(self._keys, keys, side="right") - starts
        occupied = np.flatnonzero(counts)
        self._compare_runs(gaussians[occupied], starts[occupied], counts[occupied])

    def squared_distances_outside(self) -> Int64:
        """Return the `[N]` squared distances to the nearest point outside the 27 searched cells."""
        below = self._positions - ((self._cells - 1) << self._shift) + 1
        above = ((self._cells + 2) << self._shift) - self._positions
        least: Int64 = np.minimum(below, above).min(axis=0)
        return least * least

    def _squared_distances_to(self, cells: Int64) -> Int64:
        """Return the `[N]` squared distances from Gaussians to cells `[3, N]`; 0 inside a cell."""
        below = (cells << self._shift) - self._positions
        above = self._positions - (((cells + 1) << self._shift) - 1)
        return _squared_lengths(np.maximum(np.maximum(below, above), 0))

    def _compare_runs(self, gaussians: Int64, starts: Int64, counts: Int64) -> None:
        """Compare each Gaussian with its run of sorted anchors, in batches of limited size."""
        ends = np.cumsum(counts)
        first = 0
        while first < gaussians.size:
            compared_pairs = ends[first - 1] if first else 0
            stop = max(first + 1, int(np.searchsorted(ends, compared_pairs + _MAX_PAIRS_PER_BATCH)))
            self._compare_batch(gaussians[first:stop], starts[first:stop], counts[first:stop])
            first = stop

    def _compare_batch(self, gaussians: Int64, starts: Int64, counts: Int64) -> None:
        run_starts = np.cumsum(counts) - counts
        pair_anchors = np.arange(counts.sum()) + np.repeat(starts - run_starts, counts)
        pair_gaussians = np.repeat(gaussians, counts)
        distances = _squared_lengths(
            self._anchors[:, pair_anchors] - self._positions[:, pair_gaussians]
        )
        least_distances = np.minimum.reduceat(distances, run_starts)
        is_least = distances == np.repeat(least_distances, counts)
        tied_anchors = np.where(is_least, self._order[pair_anchors], _INT64_MAX)
        nearest = np.minimum.reduceat(tied_anchors, run_starts)
        best_distances, best_anchors = self.squared_distances[gaussians], self.nearest[gaussians]
        is_better = least_distances < best_distances
        is_better |= (least_distances == best_distances) & (nearest < best_anchors)
        self.squared_distances[gaussians] = np.where(is_better, least_distances, best_distances)
        self.nearest[gaussians] = np.where(is_better, nearest, best_anchors)


def _cell_keys(cells: Int64) -> Int64:
    """Return a unique number for each cell; cell coordinates are from -1 to 2^20."""
    cells_from_zero = cells + 1
    keys: Int64 = (cells_from_zero[0] << 42) | (cells_from_zero[1] << 21) | cells_from_zero[2]
    return keys


def _squared_lengths(differences: Int64) -> Int64:
    lengths: Int64 = (differences * differences).sum(axis=0)
    return lengths


_CELL_OFFSETS = sorted(product((-1, 0, 1), repeat=3), key=lambda offset: sum(map(abs, offset)))
