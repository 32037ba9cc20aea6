"""The ANS coder of SPEC 8.3 in plain Python integers.

An implementation that follows the text of the SPEC, and the fallback on systems without
constriction. Both produce the same words.
"""

from collections.abc import Iterable

import numpy as np

from quarc_ref.format.arrays import Bits, UInt32
from quarc_ref.format.constants import WEIGHT_BITS, WEIGHT_TOTAL, WORD_BITS
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError

_WORD_MASK = (1 << WORD_BITS) - 1
_WEIGHT_MASK = WEIGHT_TOTAL - 1


def encode_bits(runs: Iterable[tuple[Bits, int]]) -> list[int]:
    """Encode runs of bits, the last one first.

    Args:
        runs: Bits and weight of a 1 for each run, in decoding order.

    Returns:
        32-bit words in the order in which a section stores them.
    """
    state = 0
    words: list[int] = []
    for bits, weight in reversed(list(runs)):
        zero = WEIGHT_TOTAL - weight
        for bit in reversed(bits.tolist()):
            share, left = (weight, zero) if bit else (zero, 0)
            if (state >> (2 * WORD_BITS - WEIGHT_BITS)) >= share:
                words.append(state & _WORD_MASK)
                state >>= WORD_BITS
            state = ((state // share) << WEIGHT_BITS) | (left + state % share)
    while state:
        words.append(state & _WORD_MASK)
        state >>= WORD_BITS
    return words


class PythonBitDecoder:
    """Decodes runs of bits from words.

    Args:
        words: uint32 words in the order in which a section stores them.

    Raises:
        InvalidWordsError: The last word is 0.
    """

    def __init__(self, words: UInt32) -> None:
        self._words: list[int] = words.tolist()
        if self._words and self._words[-1] == 0:  # [8.3-1]
            message = "the last word is 0"
            raise InvalidWordsError(message)
        self._state = self._words.pop() if self._words else 0

    def take(self, count: int, weight: int) -> Bits:
        """Return the next `count` bits for a weight of a 1."""
        zero = WEIGHT_TOTAL - weight
        state, words = self._state, self._words
        bits = bytearray(count)
        for index in range(count):
            if state <= _WORD_MASK and words:
                state = (state << WORD_BITS) | words.pop()
            part = state & _WEIGHT_MASK
            if part >= zero:
                bits[index] = 1
                state = (state >> WEIGHT_BITS) * weight + part - zero
            else:
                state = (state >> WEIGHT_BITS) * zero + part
        self._state = state
        return np.frombuffer(bits, dtype=np.bool_)

    def finish(self) -> None:
        """Check that nothing is left.

        Raises:
            UnconsumedWordsError: The state is not 0, or words are left.
        """
        if self._state or self._words:  # [8.3-2] [8.3-3]
            message = "words are left after the last bit"
            raise UnconsumedWordsError(message)
