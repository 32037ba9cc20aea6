"""Writes planes with stated probabilities where no encoder would, and with undefined codes."""

import random

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.entropy import encode_bits
from quarc_ref.format.coding.probability import weight_of_code
from quarc_ref.format.constants import CODE_BITS, PROBABILITY_CODES, STATED_WEIGHT, WEIGHT_TOTAL
from quarc_ref.format.records import Section

_EVEN = WEIGHT_TOTAL // 2


class StatingWriter:
    """Collects planes as `PlaneWriter` does, but states probabilities at random.

    Args:
        counts: Initial counts of the contexts; not modified.
        rng: Source of random values.
        codes: Range of the codes; those from PROBABILITY_CODES on are undefined.
    """

    def __init__(self, counts: ContextCounts, rng: random.Random, codes: range) -> None:
        self._rng, self._codes = rng, codes
        self._counts = counts.copy()
        self._runs: list[tuple[Bits, int]] = []

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """See `Planes.code`."""
        if contexts.size == 0:
            return bits
        used = np.unique(contexts)
        parts = [bits[contexts == context] for context in used]
        codes = [self._draw() for _ in used]
        weights = self._counts.weights(model, used).tolist()
        stated = [code is not None for code in codes]
        said = [code >> place & 1 for code in codes if code is not None for place in _PLACES]
        self._runs.append((np.array(stated), STATED_WEIGHT))
        self._runs.append((np.array(said, dtype=np.bool_), _EVEN))
        for part, code, weight in zip(parts, codes, weights, strict=True):
            self._runs.append((part, weight if code is None else _weight_of(code)))
        ones = np.array([np.count_nonzero(part) for part in parts])
        lengths = np.array([part.size for part in parts])
        self._counts.add_bits(model, used, lengths - ones, ones)
        return bits

    def code_raw(self, bits: Bits) -> Bits:
        """See `Planes.code_raw`."""
        self._runs.append((bits, _EVEN))
        return bits

    def section(self) -> Section:
        """Return the written words."""
        return Section(encode_bits(self._runs))

    def _draw(self) -> int | None:
        return None if self._rng.random() < 0.5 else self._rng.choice(self._codes)


def _weight_of(code: int) -> int:
    """Return the weight of a code; one half for undefined codes, which no decoder uses."""
    return weight_of_code(code) if code < PROBABILITY_CODES else _EVEN


_PLACES = tuple(reversed(range(CODE_BITS)))
