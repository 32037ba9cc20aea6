"""Adaptive probabilities of contexts from counts of their bits: SPEC 8.2.

Encoder and decoder count the zeros and ones of every context across frames, so
probabilities need not be transmitted. Large counts are halved, so recent bits have more
weight.
"""

from typing import Final

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import COUNT_LIMIT, WEIGHT_BITS


class ContextCounts:
    """The counts of all contexts of all models, initially 0.

    Changes of a copy do not affect the original.
    """

    def __init__(self) -> None:
        self._models: dict[str, Int64] = {}

    def copy(self) -> "ContextCounts":
        """Return a copy of the counts."""
        copied = ContextCounts()
        copied._models = dict(self._models)
        return copied

    def of(self, model: str, contexts: Int64) -> Int64:
        """Return the `[2, n]` counts of zeros and ones in ascending contexts `[n]` of a model."""
        return self._extended_counts(model, int(contexts[-1]))[:, contexts]

    def weights(self, model: str, contexts: Int64) -> Int64:
        """Return the `[n]` weights of a 1 (of 2^24) in ascending contexts `[n]` of a model."""
        zeros, ones = self.of(model, contexts)
        weights: Int64 = ((2 * ones + 1) << WEIGHT_BITS) // (2 * (zeros + ones) + 2)
        return weights

    def learn(self, model: str, contexts: Int64, zeros: Int64, ones: Int64) -> None:
        """Add the bits of a plane to the counts.

        Args:
            model: Name of the model.
            contexts: `[n]` contexts, strictly ascending.
            zeros: `[n]` number of 0 bits in each context.
            ones: `[n]` number of 1 bits in each context.
        """
        counts = self._extended_counts(model, int(contexts[-1])).copy()
        seen = counts[:, contexts] + (zeros, ones)
        while (many := seen[0] + seen[1] > COUNT_LIMIT).any():
            seen[:, many] >>= 1
        counts[:, contexts] = seen
        self._models[model] = counts

    def _extended_counts(self, model: str, greatest: int) -> Int64:
        """Return the `[2, c]` counts of a model, extended to the greatest context."""
        counts = self._models.get(model, _NOTHING)
        if greatest < counts.shape[1]:
            return counts
        grown = np.zeros((2, 2 * greatest + 1), dtype=np.int64)
        grown[:, : counts.shape[1]] = counts
        return grown


_NOTHING: Final = np.zeros((2, 0), dtype=np.int64)
