"""Converts bits to words and back, by constriction if it is installed: SPEC 8.3.

This is the only module that imports constriction. Its models get integer weights minus 1,
the form for which its arithmetic is exact and equal to `ans`.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from quarc_ref.format.arrays import Bits, UInt32
from quarc_ref.format.coding import ans
from quarc_ref.format.constants import WEIGHT_TOTAL
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError

try:
    import constriction
except ImportError:
    HAS_CONSTRICTION = False
else:
    HAS_CONSTRICTION = True
    AnsCoder = constriction.stream.stack.AnsCoder
    Categorical = constriction.stream.model.Categorical


class BitDecoder(Protocol):
    """Decodes runs of bits from the words of a section."""

    def take(self, count: int, weight: int) -> Bits:
        """Return the next `count` bits for a weight of a 1 (of 2^24)."""
        ...

    def finish(self) -> None:
        """Raise UnconsumedWordsError unless all words are consumed."""
        ...


def encode_bits(runs: Iterable[tuple[Bits, int]]) -> UInt32:
    """Encode runs of bits to words.

    Args:
        runs: Bits and weight of a 1 (1 to 2^24 - 1) for each run, in decoding order.

    Returns:
        Words in the order in which a section stores them.
    """
    if not HAS_CONSTRICTION:
        return np.array(ans.encode_bits(runs), dtype=np.uint32)
    coder = AnsCoder()
    for bits, weight in reversed(list(runs)):
        coder.encode_reverse(bits.astype(np.int32), _model(weight))
    words: UInt32 = coder.get_compressed()
    return words


def make_bit_decoder(words: UInt32) -> BitDecoder:
    """Return a decoder of words: that of `decoding_with`, or else the fastest available.

    Raises:
        InvalidWordsError: The words are not those of any encoder.
    """
    return (_opener.get() or open_fastest)(words)


@contextmanager
def decoding_with(opener: Callable[[UInt32], BitDecoder] | None) -> Iterator[None]:
    """Make `make_bit_decoder` use another decoder within this context.

    Args:
        opener: Function with the arguments of `make_bit_decoder` and an equivalent result; None
            for the fastest decoder.
    """
    token = _opener.set(opener)
    try:
        yield
    finally:
        _opener.reset(token)


def open_fastest(words: UInt32) -> BitDecoder:
    """Return constriction's decoder if it is installed, or else the one in plain Python.

    Raises:
        InvalidWordsError: The words are not those of any encoder.
    """
    return _ConstrictionBitDecoder(words) if HAS_CONSTRICTION else ans.PythonBitDecoder(words)


class _ConstrictionBitDecoder:
    def __init__(self, words: UInt32) -> None:
        try:
            self._coder = AnsCoder(np.ascontiguousarray(words, dtype=np.uint32))
        except ValueError as error:  # [8.3-1]
            message = "the last word is 0"
            raise InvalidWordsError(message) from error

    def take(self, count: int, weight: int) -> Bits:
        bits: Bits = self._coder.decode(_model(weight), count).astype(np.bool_)
        return bits

    def finish(self) -> None:
        if not self._coder.is_empty():  # [8.3-2] [8.3-3]
            message = "words are left after the last bit"
            raise UnconsumedWordsError(message)


@lru_cache(maxsize=1 << 12)
def _model(weight: int) -> Any:  # noqa: ANN401, constriction has no types
    shares = np.array([WEIGHT_TOTAL - weight - 1, weight - 1], dtype=np.float64)
    return Categorical(shares, lazy=True)


_opener: ContextVar[Callable[[UInt32], BitDecoder] | None] = ContextVar("opener", default=None)
