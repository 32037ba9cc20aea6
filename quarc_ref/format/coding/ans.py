"""The ANS coder of SPEC 8.3 in plain Python integers.

This implementation follows the text of SPEC and is used if constriction is not installed.
It produces the same words as constriction.
"""

from collections.abc import Iterable

import numpy as np

from quarc_ref.format.arrays import Bits, UInt32
from quarc_ref.format.constants import WEIGHT_BITS, WEIGHT_TOTAL, WORD_BITS
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError

_WORD_MASK = (1 << WORD_BITS) - 1
_WEIGHT_MASK = WEIGHT_TOTAL - 1


def encode_bits(runs: Iterable[tuple[Bits, int]]) -> list[int]:
    """Encode runs of bits, beginning with the last run.

    Args:
        runs: In decoding order, the bits of each run and the weight of a 1 bit (out of 2^24).

    Returns:
        32-bit words in the order in which a section stores them.
    """
    state = 0
    words: list[int] = []
    for bits, weight in reversed(list(runs)):
        zero_weight = WEIGHT_TOTAL - weight
        for bit in reversed(bits.tolist()):
            bit_weight, bit_start = (weight, zero_weight) if bit else (zero_weight, 0)
            if (state >> (2 * WORD_BITS - WEIGHT_BITS)) >= bit_weight:
                words.append(state & _WORD_MASK)
                state >>= WORD_BITS
            state = ((state // bit_weight) << WEIGHT_BITS) | (bit_start + state % bit_weight)
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
        """Decode the next `count` bits, in which a 1 bit has the given weight (out of 2^24)."""
        zero_weight = WEIGHT_TOTAL - weight
        state, words = self._state, self._words
        bits = bytearray(count)
        for index in range(count):
            if state <= _WORD_MASK and words:
                state = (state << WORD_BITS) | words.pop()
            remainder = state & _WEIGHT_MASK
            if remainder >= zero_weight:
                bits[index] = 1
                state = (state >> WEIGHT_BITS) * weight + remainder - zero_weight
            else:
                state = (state >> WEIGHT_BITS) * zero_weight + remainder
        self._state = state
        return np.frombuffer(bits, dtype=np.bool_)

    def finish(self) -> None:
        """Check that all words have been consumed.

        Raises:
            UnconsumedWordsError: Words remain, or the state is not 0.
        """
        if self._state or self._words:  # [8.3-2] [8.3-3]
            message = "words are left after the last bit"
            raise UnconsumedWordsError(message)
