"""Finds the exact nearest anchor of every Gaussian: SPEC 6.4.

The result is the anchor with the smallest (squared distance, index). It is found through
a grid: anchors in a Gaussian's own cell bound the distance, and only those of the 26
cells around it that are within the bound are searched. A Gaussian whose bound extends
beyond these cells is compared with every anchor.
"""

from itertools import product

import numpy as np

from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.constants import LATTICE_OFFSET

_MIN_SHIFT = 4
_PAIRS_AT_ONCE = 1 << 20
_UNBOUND = np.iinfo(np.int64).max


def bind(positions: Int32, anchors: Int32, shift: int) -> Int64:
    """Return the index of the nearest anchor of every Gaussian.

    Args:
        positions: `[3, N]` Gaussians, lattice units.
        anchors: `[3, A]` anchors, lattice units, A at least 1.
        shift: Binary logarithm of the cell size, chosen for about one anchor per cell. It
            affects only the time.

    Returns:
        `[N]` anchor indices; among equally near anchors, the lowest index.
    """
    first = _first_of_each_place(anchors)
    anchors = anchors[:, first]
    search = _CellSearch(positions, anchors, max(shift, _MIN_SHIFT))
    for step in _NEIGHBORS:
        search.search_cell(np.array(step, dtype=np.int64))
    reached = search.nearest_outside() <= search.distances
    far = np.flatnonzero(reached)
    search.answers[far] = bind_exhaustively(positions[:, far], anchors)
    return first[search.answers]


def bind_exhaustively(positions: Int32, anchors: Int32) -> Int64:
    """Return what `bind` returns, by comparing every Gaussian with every anchor."""
    answers = np.zeros(positions.shape[1], dtype=np.int64)
    rows = max(1, _PAIRS_AT_ONCE // anchors.shape[1])
    for start in range(0, answers.size, rows):
        part = positions[:, start : start + rows, None].astype(np.int64)
        answers[start : start + rows] = _squared(part - anchors[:, None, :]).argmin(axis=1)
    return answers


def _first_of_each_place(anchors: Int32) -> Int64:
    """Return the indices, ascending, of the first anchor at each position.

    The first of several anchors at the same position is always chosen. A few bytes of a stream can
    put all anchors at one position, where comparing each with every Gaussian would take minutes.
    """
    order = np.lexsort(anchors)  # a stable sort keeps the indices at one position ascending
    apart = np.any(np.diff(anchors[:, order], axis=1), axis=0)
    return np.sort(order[np.append(True, apart)])


class _CellSearch:
    """Anchors sorted by cell, and the best anchor so far of every Gaussian."""

    def __init__(self, positions: Int32, anchors: Int32, shift: int) -> None:
        self._positions = positions.astype(np.int64) + LATTICE_OFFSET
        self._cells = self._positions >> shift
        self._shift = shift
        keys = _key(anchors.astype(np.int64) + LATTICE_OFFSET >> shift)
        self._order = np.argsort(keys, kind="stable")
        self._anchors = anchors.astype(np.int64)[:, self._order] + LATTICE_OFFSET
        self._keys = keys[self._order]
        self.answers = np.zeros(positions.shape[1], dtype=np.int64)
        self.distances = np.full(positions.shape[1], _UNBOUND)

    def search_cell(self, step: Int64) -> None:
        """Improve the results with the anchors of a neighboring cell."""
        cells = self._cells + step[:, None]
        asked = np.flatnonzero(self._distance_to(cells) <= self.distances)
        keys = _key(cells[:, asked])
        starts = np.searchsorted(self._keys, keys, side="left")
        counts = np.searchsorted(self._keys, keys, side="right") - starts
        there = np.flatnonzero(counts)
        self._compare_runs(asked[there], starts[there], counts[there])

    def nearest_outside(self) -> Int64:
        """Return the `[N]` squared distance to the nearest point outside the 27 cells."""
        low = self._positions - ((self._cells - 1) << self._shift) + 1
        high = ((self._cells + 2) << self._shift) - self._positions
        least: Int64 = np.minimum(low, high).min(axis=0)
        return least * least

    def _distance_to(self, cells: Int64) -> Int64:
        """Return the `[N]` squared distance of each Gaussian to a cell; 0 inside it."""
        below = (cells << self._shift) - self._positions
        above = self._positions - (((cells + 1) << self._shift) - 1)
        return _squared(np.maximum(np.maximum(below, above), 0))

    def _compare_runs(self, asked: Int64, starts: Int64, counts: Int64) -> None:
        """Compare the Gaussians `asked` with runs of anchors that start at `starts`."""
        ends = np.cumsum(counts)
        first = 0
        while first < asked.size:
            done = ends[first - 1] if first else 0
            last = max(first + 1, int(np.searchsorted(ends, done + _PAIRS_AT_ONCE)))
            self._compare_part(asked[first:last], starts[first:last], counts[first:last])
            first = last

    def _compare_part(self, asked: Int64, starts: Int64, counts: Int64) -> None:
        borders = np.cumsum(counts) - counts
        slots = np.arange(counts.sum()) + np.repeat(starts - borders, counts)
        who = np.repeat(asked, counts)
        distances = _squared(self._anchors[:, slots] - self._positions[:, who])
        least = np.minimum.reduceat(distances, borders)
        tied = np.where(distances == np.repeat(least, counts), self._order[slots], _UNBOUND)
        answers = np.minimum.reduceat(tied, borders)
        best, known = self.distances[asked], self.answers[asked]
        better = (least < best) | ((least == best) & (answers < known))
        self.distances[asked] = np.where(better, least, best)
        self.answers[asked] = np.where(better, answers, known)


def _key(cells: Int64) -> Int64:
    """Return one number per cell; each axis is from -1 to 2^20."""
    offset = cells + 1
    keys: Int64 = (offset[0] << 42) | (offset[1] << 21) | offset[2]
    return keys


def _squared(differences: Int64) -> Int64:
    squared: Int64 = (differences * differences).sum(axis=0)
    return squared


_NEIGHBORS = sorted(product((-1, 0, 1), repeat=3), key=lambda step: sum(map(abs, step)))
