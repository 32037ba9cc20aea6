"""Writes planes with random stated probabilities, including undefined codes."""

import random

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.entropy import encode_bits
from quarc_ref.format.coding.probability import weight_of_probability_code
from quarc_ref.format.constants import CODE_BITS, PROBABILITY_CODES, STATED_WEIGHT, WEIGHT_TOTAL
from quarc_ref.format.records import Section

_EQUIPROBABLE_WEIGHT = WEIGHT_TOTAL // 2


class StatingWriter:
    """Collects planes like `PlaneWriter`, but states random probabilities for random contexts.

    Args:
        counts: Initial counts of the contexts; not modified.
        rng: Source of random values.
        codes: Range of the codes to draw; codes of PROBABILITY_CODES or more are undefined.
    """

    def __init__(self, counts: ContextCounts, rng: random.Random, codes: range) -> None:
        self._rng, self._codes = rng, codes
        self._counts = counts.copy()
        self._runs: list[tuple[Bits, int]] = []

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """See `Planes.code`."""
        if contexts.size == 0:
            return bits
        distinct_contexts = np.unique(contexts)
        bits_by_context = [bits[contexts == context] for context in distinct_contexts]
        codes = [self._choose_code() for _ in distinct_contexts]
        weights = self._counts.compute_weights(model, distinct_contexts).tolist()
        is_stated = [code is not None for code in codes]
        code_bits = [
            code >> bit_number & 1
            for code in codes
            if code is not None
            for bit_number in _BIT_ORDER
        ]
        self._runs.append((np.array(is_stated), STATED_WEIGHT))
        self._runs.append((np.array(code_bits, dtype=np.bool_), _EQUIPROBABLE_WEIGHT))
        for context_bits, code, weight in zip(bits_by_context, codes, weights, strict=True):
            self._runs.append((context_bits, weight if code is None else _get_weight(code)))
        ones = np.array([np.count_nonzero(context_bits) for context_bits in bits_by_context])
        lengths = np.array([context_bits.size for context_bits in bits_by_context])
        self._counts.add_bits(model, distinct_contexts, lengths - ones, ones)
        return bits

    def code_raw(self, bits: Bits) -> Bits:
        """See `Planes.code_raw`."""
        self._runs.append((bits, _EQUIPROBABLE_WEIGHT))
        return bits

    def section(self) -> Section:
        """Return the coded words as a section."""
        return Section(encode_bits(self._runs))

    def _choose_code(self) -> int | None:
        return None if self._rng.random() < 0.5 else self._rng.choice(self._codes)


def _get_weight(code: int) -> int:
    """Return the weight of a 1 that a code states; half of the total for an undefined code."""
    return weight_of_probability_code(code) if code < PROBABILITY_CODES else _EQUIPROBABLE_WEIGHT


_BIT_ORDER = tuple(reversed(range(CODE_BITS)))
