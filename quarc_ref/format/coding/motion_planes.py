"""Codes the residuals of a frame's anchors as planes: SPEC 8.7.

Levels are coded from coarse to fine. The first plane of a level codes whether each anchor
moves. For anchors that move, the next planes code for each channel whether the symbol is
nonzero. The last planes code the signs of nonzero symbols and, in unary, their magnitudes.
The contexts depend on the expected residual of an anchor: the motion of its Gaussian in the
previous frame, minus the motion that coarser levels have already coded.
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
    """Data about a level's anchors that is known before the level's symbols are coded.

    Attributes:
        parents: `[a]` index of each anchor's parent in the next coarser level.
        previous_motion: `[c, a]` motion of each anchor's Gaussian in the previous frame: the
            sum of the symbols of all levels; 0 if the Gaussian was deleted.
    """

    parents: Int64
    previous_motion: Int16


def write_motion(
    levels: Sequence[LevelContext], symbols: Sequence[Int64], counts: ContextCounts
) -> Section:
    """Encode the symbols of a frame.

    Args:
        levels: Context data of each level, beginning with level 1, the finest.
        symbols: `[c, a]` symbols of each level, beginning with level 1.
        counts: Counts of the contexts before the frame.

    Raises:
        EncodeError: A symbol exceeds 65 in magnitude.
    """
    if any(np.any(np.abs(level_symbols) > SYMBOL_LIMIT) for level_symbols in symbols):
        message = f"a symbol exceeds {SYMBOL_LIMIT} in magnitude: increase the quantization step"
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
        levels: Context data of each level, beginning with level 1, the finest.
        counts: Counts of the contexts before the frame.

    Returns:
        `[c, a]` symbols of each level, beginning with level 1, and the updated counts.

    Raises:
        EntropyError: The section is malformed.
    """
    reader = PlaneReader(section, counts)
    placeholder = [np.broadcast_to(_ZERO, level.previous_motion.shape) for level in levels]
    symbols = _code_motion(reader, levels, placeholder)
    return symbols, reader.finish()


def _code_motion(
    planes: Planes, levels: Sequence[LevelContext], symbols: Sequence[Int64]
) -> list[Int64]:
    coarser = _CoarserSums.zeros_above_coarsest(levels[-1].parents, symbols[-1].shape[0])
    coded: list[Int64] = []
    for level_index in reversed(range(len(levels))):
        if coded:
            coarser = coarser.add_level(levels[level_index + 1].parents, coded[-1])
        level = _LevelCoder(planes, level_index + 1, levels[level_index], coarser)
        coded.append(level.code_symbols(symbols[level_index]))
    return coded[::-1]


@dataclass(frozen=True, slots=True)
class _CoarserSums:
    """Sums over a level and all coarser levels, which select contexts of the next finer level.

    Attributes:
        sums: `[c, a]` sums of the symbols of each anchor and all its ancestors.
        magnitudes: `[a]` sums, over the channels, of the magnitudes of each anchor's symbols.
    """

    sums: Int64
    magnitudes: Int64

    @classmethod
    def zeros_above_coarsest(cls, parents: Int64, channel_count: int) -> "_CoarserSums":
        """Return the sums before the coarsest level is coded, which are 0."""
        count = int(parents.max()) + 1
        return cls(
            np.zeros((channel_count, count), dtype=np.int64), np.zeros(count, dtype=np.int64)
        )

    def add_level(self, parents: Int64, symbols: Int64) -> "_CoarserSums":
        """Return the sums that include the symbols of the next finer level."""
        return _CoarserSums(self.sums.take(parents, axis=1) + symbols, np.abs(symbols).sum(axis=0))


class _LevelCoder:
    """Codes the planes of one level."""

    def __init__(
        self, planes: Planes, level_number: int, context: LevelContext, coarser: _CoarserSums
    ) -> None:
        self._planes = planes
        self._name = f"motion {level_number}"
        self._context = context
        self._coarser = coarser

    def code_symbols(self, symbols: Int64) -> Int64:
        """Code the symbols `[c, a]` of the level's anchors."""
        moving_anchors = np.flatnonzero(
            self._code_moves(np.bitwise_or.reduce(symbols, axis=0) != 0)
        )
        expected_residuals, moving_symbols = (
            self._expected_residuals(moving_anchors),
            symbols[:, moving_anchors],
        )
        is_nonzero = self._code_nonzero(expected_residuals, moving_symbols)
        coded_moving_symbols = np.zeros_like(moving_symbols)
        coded_moving_symbols[is_nonzero] = self._code_signs_and_magnitudes(
            expected_residuals[is_nonzero], moving_symbols[is_nonzero]
        )
        coded = np.zeros(symbols.shape, dtype=np.int64)
        coded[:, moving_anchors] = coded_moving_symbols
        return coded

    def _expected_residuals(self, anchors: Int64) -> Int64:
        """Return the `[c, n]` previous motion of anchors `[n]` minus the sums of coarser levels."""
        parents = self._context.parents[anchors]
        return self._context.previous_motion[:, anchors] - self._coarser.sums[:, parents]

    def _code_moves(self, is_moving: Bits) -> Bits:
        """Code which anchors `[a]` move; anchors without expected motion share context 0."""
        coarser_motion_bits = (
            np.bitwise_or.reduce(self._coarser.sums, axis=0) | self._coarser.magnitudes
        )
        parent_motion_bits = coarser_motion_bits[self._context.parents]
        anchors_with_context = np.flatnonzero(
            np.bitwise_or.reduce(self._context.previous_motion, axis=0) | parent_motion_bits
        )
        parent_magnitudes = self._coarser.magnitudes[self._context.parents[anchors_with_context]]
        expected_magnitudes = np.abs(self._expected_residuals(anchors_with_context)).sum(axis=0)
        contexts = np.zeros(is_moving.size, dtype=np.int64)
        contexts[anchors_with_context] = _EXPECTED_CLASSES.count * _PARENT_CLASSES.classify(
            parent_magnitudes
        )
        contexts[anchors_with_context] += _EXPECTED_CLASSES.classify(expected_magnitudes)
        return self._planes.code(f"{self._name}, moves", contexts, is_moving)

    def _code_nonzero(self, expected_residuals: Int64, symbols: Int64) -> Bits:
        """Code which symbols are nonzero; contexts depend on the channels coded before, too."""
        is_nonzero = np.zeros(symbols.shape, dtype=np.bool_)
        nonzero_counts = np.zeros(symbols.shape[1], dtype=np.int64)
        for channel, component in enumerate(_name_channels(symbols.shape[0])):
            clipped_magnitudes = np.minimum(np.abs(expected_residuals[channel]), _MAX_CONTEXT_VALUE)
            contexts = (_MAX_CONTEXT_VALUE + 1) * clipped_magnitudes + np.minimum(
                nonzero_counts, _MAX_CONTEXT_VALUE
            )
            model = f"{self._name}, {component} not 0"
            is_nonzero[channel] = self._planes.code(model, contexts, symbols[channel] != 0)
            nonzero_counts += is_nonzero[channel]
        return is_nonzero

    def _code_signs_and_magnitudes(self, expected_residuals: Int64, symbols: Int64) -> Int64:
        """Code the signs, then the magnitudes, of nonzero symbols `[n]` in channel order."""
        contexts = _SIGN_CONTEXTS.classify(expected_residuals)
        negative = self._planes.code(f"{self._name}, sign", contexts, symbols < 0)
        residuals_along_sign = np.where(negative, -expected_residuals, expected_residuals)
        magnitudes = np.ones_like(symbols)
        remaining = np.arange(symbols.size)
        for plane in range(MAGNITUDE_PLANES):
            contexts = _ALONG_SIGN_CLASSES.classify(residuals_along_sign[remaining] - plane)
            contexts = contexts + _ALONG_SIGN_CLASSES.count * min(
                plane, _LAST_PLANE_WITH_OWN_CONTEXTS
            )
            is_larger = np.abs(symbols[remaining]) > plane + 1
            remaining = remaining[
                self._planes.code(f"{self._name}, magnitude", contexts, is_larger)
            ]
            magnitudes[remaining] += 1
        return np.where(negative, -magnitudes, magnitudes)


def _name_channels(channel_count: int) -> list[str]:
    """Return the word for each channel in model names; w exists only if there are 7 channels."""
    return ["translation"] * 3 + ["w"] * (channel_count - 6) + ["rotation"] * 3


class _Classes:
    """Classes of integers: class 0 is below all borders; class k begins at the k-th border."""

    def __init__(self, *borders: int) -> None:
        self.count = len(borders) + 1
        self._minimum, self._maximum = borders[0] - 1, borders[-1]
        values = np.arange(self._minimum, self._maximum + 1)
        self._table = np.searchsorted(np.array(borders), values, side="right")

    def classify(self, values: Int64) -> Int64:
        clipped = np.maximum(
            np.minimum(values, self._maximum), self._minimum
        )  # np.clip has a large overhead
        classes: Int64 = self._table[clipped - self._minimum]
        return classes


_ZERO = np.int64(0)
_MAX_CONTEXT_VALUE = 3
_LAST_PLANE_WITH_OWN_CONTEXTS = 2
_PARENT_CLASSES = _Classes(1, 2, 4)
_EXPECTED_CLASSES = _Classes(1, 2, 4, 8)
_SIGN_CONTEXTS = _Classes(-7, -3, -1, 0, 1, 2, 4, 8)
_ALONG_SIGN_CLASSES = _Classes(-8, -3, -1, 0, 1, 2, 3, 4, 6, 10)
