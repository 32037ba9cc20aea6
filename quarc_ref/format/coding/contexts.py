"""Adaptive probabilities, computed from the bits counted in each context: SPEC 8.2.

Encoder and decoder count the zeros and ones of every context across frames, so
probabilities need not be transmitted. Large counts are halved, so recent bits have more
weight.
"""

from typing import Final

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import COUNT_LIMIT, WEIGHT_BITS


class ContextCounts:
    """The numbers of 0 and 1 bits in all contexts of all models, initially 0.

    A change to a copy does not affect the original.
    """

    def __init__(self) -> None:
        self._counts_by_model: dict[str, Int64] = {}

    def copy(self) -> "ContextCounts":
        """Return a copy of the counts."""
        duplicate = ContextCounts()
        duplicate._counts_by_model = dict(self._counts_by_model)
        return duplicate

    def look_up_counts(self, model: str, contexts: Int64) -> Int64:
        """Return the `[2, n]` counts of zeros and ones in ascending contexts `[n]` of a model."""
        return self._extended_counts(model, int(contexts[-1]))[:, contexts]

    def compute_weights(self, model: str, contexts: Int64) -> Int64:
        """Return the `[n]` weights (8.2) of bits that are 1, in ascending contexts of a model."""
        zeros, ones = self.look_up_counts(model, contexts)
        weights: Int64 = ((2 * ones + 1) << WEIGHT_BITS) // (2 * (zeros + ones) + 2)
        return weights

    def add_bits(self, model: str, contexts: Int64, zeros: Int64, ones: Int64) -> None:
        """Add the bits of a plane to the counts.

        Args:
            model: Name of the model.
            contexts: `[n]` contexts, strictly ascending.
            zeros: `[n]` number of 0 bits in each context.
            ones: `[n]` number of 1 bits in each context.
        """
        counts = self._extended_counts(model, int(contexts[-1])).copy()
        updated = counts[:, contexts] + (zeros, ones)
        while (over_limit := updated[0] + updated[1] > COUNT_LIMIT).any():
            updated[:, over_limit] >>= 1
        counts[:, contexts] = updated
        self._counts_by_model[model] = counts

    def _extended_counts(self, model: str, max_context: int) -> Int64:
        """Return the `[2, c]` counts of a model, where c is greater than `max_context`."""
        counts = self._counts_by_model.get(model, _NO_COUNTS)
        if max_context < counts.shape[1]:
            return counts
        extended = np.zeros((2, 2 * max_context + 1), dtype=np.int64)
        extended[:, : counts.shape[1]] = counts
        return extended


_NO_COUNTS: Final = np.zeros((2, 0), dtype=np.int64)
