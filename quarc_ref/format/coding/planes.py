"""Codes planes of bits with contexts, and the sections that contain them: SPEC 8.1.

A plane has one bit per element, for example per anchor, and each element has a context of
the plane's model. All bits of a plane that have the same context form one run and are coded
with one probability, which is computed from the context's counts or written explicitly.

A walk is a function that codes the planes of a section in order; the same walk encodes and
decodes. A `PlaneWriter` returns the bits that it is given; a `PlaneReader` ignores them and
returns the bits of the section. After every plane, a walk must use the returned bits instead of
its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.entropy import encode_bits, make_bit_decoder
from quarc_ref.format.coding.pricing import saves_bits
from quarc_ref.format.coding.probability import choose_codes, weight_of_probability_code
from quarc_ref.format.constants import CODE_BITS, STATED_WEIGHT, WEIGHT_TOTAL
from quarc_ref.format.records import Section

_EQUIPROBABLE_WEIGHT = WEIGHT_TOTAL // 2


class Planes(Protocol):
    """Interface through which a walk encodes or decodes planes."""

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """Code one plane.

        Args:
            model: Name of the model.
            contexts: `[n]` context of each element, at least 0.
            bits: `[n]` bits to write; ignored when reading.

        Returns:
            `[n]` bits of the plane.

        Raises:
            BitstreamError: When reading, the section is malformed.
        """
        ...

    def code_raw(self, bits: Bits) -> Bits:
        """Code equiprobable bits without contexts."""
        ...


class PlaneWriter:
    """Collects planes and builds a section.

    Args:
        counts: Current counts of the contexts, which are not modified.
    """

    def __init__(self, counts: ContextCounts) -> None:
        self._counts = counts.copy()
        self._runs: list[tuple[Bits, int]] = []

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """See `Planes.code`."""
        if contexts.size == 0:
            return bits
        runs = _Runs.group(contexts)
        runs_of_bits = np.split(bits[runs.order], runs.starts[1:])
        zeros, ones = runs.count_zeros_and_ones(runs_of_bits)
        weights = self._counts.compute_weights(model, runs.contexts)
        codes = choose_codes(ones, runs.lengths)
        fitted_weights = np.array([weight_of_probability_code(code) for code in codes.tolist()])
        is_stated = saves_bits(zeros, ones, weights, fitted_weights)
        code_bits = np.unpackbits(codes[is_stated].astype(np.uint8))
        self._runs += [
            (is_stated, STATED_WEIGHT),
            (code_bits.astype(np.bool_), _EQUIPROBABLE_WEIGHT),
        ]
        weights[is_stated] = fitted_weights[is_stated]
        self._runs.extend(zip(runs_of_bits, weights.tolist(), strict=True))
        self._counts.add_bits(model, runs.contexts, zeros, ones)
        return bits

    def code_raw(self, bits: Bits) -> Bits:
        """See `Planes.code_raw`."""
        self._runs.append((bits, _EQUIPROBABLE_WEIGHT))
        return bits

    def section(self) -> Section:
        """Return the coded section."""
        return Section(encode_bits(self._runs))


class PlaneReader:
    """Decodes the planes of a section.

    Args:
        section: Section of a chunk whose CRC has been checked.
        counts: Current counts of the contexts, which are not modified.

    Raises:
        InvalidWordsError: No encoder can produce the words of the section.
    """

    def __init__(self, section: Section, counts: ContextCounts) -> None:
        self._counts = counts.copy()
        self._bit_decoder = make_bit_decoder(section.words)

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """See `Planes.code`."""
        if contexts.size == 0:
            return bits
        runs = _Runs.group(contexts)
        is_stated = self._bit_decoder.take(runs.contexts.size, STATED_WEIGHT)
        codes = np.packbits(
            self._bit_decoder.take(CODE_BITS * int(is_stated.sum()), _EQUIPROBABLE_WEIGHT)
        )
        weights = self._counts.compute_weights(model, runs.contexts)
        weights[is_stated] = [weight_of_probability_code(code) for code in codes.tolist()]
        lengths_and_weights = zip(runs.lengths.tolist(), weights.tolist(), strict=True)
        runs_of_bits = [
            self._bit_decoder.take(count, weight) for count, weight in lengths_and_weights
        ]
        self._counts.add_bits(model, runs.contexts, *runs.count_zeros_and_ones(runs_of_bits))
        decoded = np.empty_like(bits)
        decoded[runs.order] = np.concatenate(runs_of_bits)
        return decoded

    def code_raw(self, bits: Bits) -> Bits:
        """See `Planes.code_raw`."""
        return self._bit_decoder.take(bits.size, _EQUIPROBABLE_WEIGHT)

    def finish(self) -> ContextCounts:
        """Check that all words have been consumed, and return the updated counts.

        Raises:
            UnconsumedWordsError: Words remain.
        """
        self._bit_decoder.finish()
        return self._counts


@dataclass(frozen=True, slots=True, eq=False)
class _Runs:
    """The elements of a plane, sorted by context.

    Attributes:
        order: `[n]` indices of the elements, sorted by context and index.
        contexts: `[u]` contexts that occur, ascending.
        lengths: `[u]` number of elements in each context.
        starts: `[u]` index in `order` of the first element of each context.
    """

    order: Int64
    contexts: Int64
    lengths: Int64
    starts: Int64

    @classmethod
    def group(cls, contexts: Int64) -> "_Runs":
        counts = np.bincount(contexts)
        # NumPy uses radix sort for 16-bit numbers, which is four times as fast.
        sort_keys = contexts.astype(np.uint16) if counts.size <= _UINT16_CONTEXT_LIMIT else contexts
        used_contexts = np.flatnonzero(counts)
        lengths = counts[used_contexts]
        return cls(
            np.argsort(sort_keys, kind="stable"),
            used_contexts,
            lengths,
            np.cumsum(lengths) - lengths,
        )

    def count_zeros_and_ones(self, runs_of_bits: Sequence[Bits]) -> tuple[Int64, Int64]:
        """Return the `[u]` numbers of zeros and the `[u]` numbers of ones in each context."""
        ones = np.array([np.count_nonzero(part) for part in runs_of_bits])
        return self.lengths - ones, ones


_UINT16_CONTEXT_LIMIT = 1 << 16
