"""Codes the residuals of a frame's anchors as planes: SPEC 8.7.

Levels go from coarse to fine. The first plane codes whether each anchor moves. For
anchors that move, the next planes code, channel by channel, whether a symbol is nonzero,
and then the signs and, in unary, the magnitudes of nonzero symbols. The contexts depend
on the expected residual of an anchor: the motion of its Gaussian in the last frame, minus
the motion of the coarser levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.format.arrays import Bits, Int16, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.planes import PlaneReader, Planes, PlaneWriter
from quarc_ref.format.constants import MAGNITUDE_PLANES, SYMBOL_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Section


@dataclass(frozen=True, slots=True)
class LevelContext:
    """Data about a level's anchors that encoder and decoder have before its symbols.

    Attributes:
        parents: `[a]` index in the next coarser level of each anchor's parent.
        previous: `[c, a]` motion of each anchor's Gaussian in the last frame, which is
            the sum of the symbols of all levels; 0 if there is none.
    """

    parents: Int64
    previous: Int16


def write_motion(
    levels: Sequence[LevelContext], symbols: Sequence[Int64], counts: ContextCounts
) -> Section:
    """Code the symbols of a frame.

    Args:
        levels: Contexts, level 1 (the finest) first.
        symbols: `[c, a]` symbols of each level, level 1 first.
        counts: Counts of the contexts before the frame.

    Raises:
        EncodeError: A symbol exceeds 65 in magnitude.
    """
    if any(np.any(np.abs(level) > SYMBOL_LIMIT) for level in symbols):
        message = f"a symbol exceeds {SYMBOL_LIMIT}: increase the step"
        raise EncodeError(message)
    writer = PlaneWriter(counts)
    _code_motion(writer, levels, symbols)
    return writer.section()


def read_motion(
    section: Section, levels: Sequence[LevelContext], counts: ContextCounts
) -> tuple[list[Int64], ContextCounts]:
    """Decode the symbols of a frame.

    Args:
        section: Section of the FRAM chunk.
        levels: Contexts, level 1 (the finest) first.
        counts: Counts of the contexts before the frame.

    Returns:
        `[c, a]` symbols of each level, level 1 first, and the updated counts.

    Raises:
        EntropyError: The section is malformed.
    """
    reader = PlaneReader(section, counts)
    blank = [np.broadcast_to(_ZERO, level.previous.shape) for level in levels]
    symbols = _code_motion(reader, levels, blank)
    return symbols, reader.finish()


def _code_motion(
    planes: Planes, levels: Sequence[LevelContext], symbols: Sequence[Int64]
) -> list[Int64]:
    done = _CoarserLevels.above_coarsest(levels[-1].parents, symbols[-1].shape[0])
    coded: list[Int64] = []
    for number in reversed(range(len(levels))):
        if coded:
            done = done.extended_by(levels[number + 1].parents, coded[-1])
        level = _Level(planes, number + 1, levels[number], done)
        coded.append(level.walk(symbols[number]))
    return coded[::-1]


@dataclass(frozen=True, slots=True)
class _CoarserLevels:
    """Data that the anchors of a level pass to their children.

    Attributes:
        sums: `[c, a]` sums of the symbols of anchors and all their ancestors.
        magnitudes: `[a]` sums of the magnitudes of an anchor's symbols over the channels.
    """

    sums: Int64
    magnitudes: Int64

    @classmethod
    def above_coarsest(cls, parents: Int64, channels: int) -> "_CoarserLevels":
        """Return the data above the coarsest level."""
        count = int(parents.max()) + 1
        return cls(np.zeros((channels, count), dtype=np.int64), np.zeros(count, dtype=np.int64))

    def extended_by(self, parents: Int64, symbols: Int64) -> "_CoarserLevels":
        """Return the data that the next level passes down."""
        return _CoarserLevels(
            self.sums.take(parents, axis=1) + symbols, np.abs(symbols).sum(axis=0)
        )


class _Level:
    """The planes of one level."""

    def __init__(
        self, planes: Planes, number: int, context: LevelContext, above: _CoarserLevels
    ) -> None:
        self._planes = planes
        self._name = f"motion {number}"
        self._context = context
        self._above = above

    def walk(self, values: Int64) -> Int64:
        """Code the symbols `[c, a]` of the level's anchors."""
        moving = np.flatnonzero(self._moves(np.bitwise_or.reduce(values, axis=0) != 0))
        expected, values_moving = self._expected(moving), values[:, moving]
        there = self._not_zero(expected, values_moving)
        coded_of_moving = np.zeros_like(values_moving)
        coded_of_moving[there] = self._signed(expected[there], values_moving[there])
        coded = np.zeros(values.shape, dtype=np.int64)
        coded[:, moving] = coded_of_moving
        return coded

    def _expected(self, anchors: Int64) -> Int64:
        """Return the `[c, n]` last motion of anchors `[n]`, minus that of coarser levels."""
        parents = self._context.parents[anchors]
        return self._context.previous[:, anchors] - self._above.sums[:, parents]

    def _moves(self, moving: Bits) -> Bits:
        """Code which anchors `[a]` move; most have no expected motion and share a context."""
        done = np.bitwise_or.reduce(self._above.sums, axis=0) | self._above.magnitudes
        parents_moving = done[self._context.parents]
        asked = np.flatnonzero(
            np.bitwise_or.reduce(self._context.previous, axis=0) | parents_moving
        )
        above = self._above.magnitudes[self._context.parents[asked]]
        expected = np.abs(self._expected(asked)).sum(axis=0)
        contexts = np.zeros(moving.size, dtype=np.int64)
        contexts[asked] = _EXPECTED_CLASSES.count * _PARENT_CLASSES.of(above)
        contexts[asked] += _EXPECTED_CLASSES.of(expected)
        return self._planes.code(f"{self._name}, moves", contexts, moving)

    def _not_zero(self, expected: Int64, values: Int64) -> Bits:
        """Code by channel whether symbols are nonzero; the context includes the count so far."""
        there = np.zeros(values.shape, dtype=np.bool_)
        so_far = np.zeros(values.shape[1], dtype=np.int64)
        for channel, kind in enumerate(_kinds(values.shape[0])):
            near = np.minimum(np.abs(expected[channel]), _MAXIMUM)
            contexts = (_MAXIMUM + 1) * near + np.minimum(so_far, _MAXIMUM)
            model = f"{self._name}, {kind} not 0"
            there[channel] = self._planes.code(model, contexts, values[channel] != 0)
            so_far += there[channel]
        return there

    def _signed(self, expected: Int64, values: Int64) -> Int64:
        """Code signs, then magnitudes above 0, by channel `[n]`."""
        contexts = _SIGN_CONTEXTS.of(expected)
        negative = self._planes.code(f"{self._name}, sign", contexts, values < 0)
        ahead = np.where(negative, -expected, expected)
        magnitudes = np.ones_like(values)
        left = np.arange(values.size)
        for plane in range(MAGNITUDE_PLANES):
            contexts = _AHEAD_CLASSES.of(ahead[left] - plane)
            contexts = contexts + _AHEAD_CLASSES.count * min(plane, _LAST_OWN_PLANE)
            beyond = np.abs(values[left]) > plane + 1
            left = left[self._planes.code(f"{self._name}, magnitude", contexts, beyond)]
            magnitudes[left] += 1
        return np.where(negative, -magnitudes, magnitudes)


def _kinds(channels: int) -> list[str]:
    """Return the component of each channel: x, y, z, possibly w, and x, y, z."""
    return ["translation"] * 3 + ["w"] * (channels - 6) + ["rotation"] * 3


class _Classes:
    """Lookup table of integer classes: class k starts at border k, class 0 is below all."""

    def __init__(self, *borders: int) -> None:
        self.count = len(borders) + 1
        self._least, self._most = borders[0] - 1, borders[-1]
        numbers = np.arange(self._least, self._most + 1)
        self._table = np.searchsorted(np.array(borders), numbers, side="right")

    def of(self, numbers: Int64) -> Int64:
        within = np.maximum(
            np.minimum(numbers, self._most), self._least
        )  # np.clip has a large overhead
        classes: Int64 = self._table[within - self._least]
        return classes


_ZERO = np.int64(0)
_MAXIMUM = 3
_LAST_OWN_PLANE = 2
_PARENT_CLASSES = _Classes(1, 2, 4)
_EXPECTED_CLASSES = _Classes(1, 2, 4, 8)
_SIGN_CONTEXTS = _Classes(-7, -3, -1, 0, 1, 2, 4, 8)
_AHEAD_CLASSES = _Classes(-8, -3, -1, 0, 1, 2, 3, 4, 6, 10)
