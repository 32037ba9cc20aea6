"""Entropy coding of bits, with constriction if it is installed: SPEC 8.3.

This is the only module that imports constriction. Constriction's models are made from the
integer weights minus 1, which makes its arithmetic exact, so it produces the same words as `ans`.
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
        """Decode the next `count` bits, in which a 1 bit has the given weight (out of 2^24)."""
        ...

    def finish(self) -> None:
        """Raise UnconsumedWordsError unless all words have been consumed."""
        ...


def encode_bits(runs: Iterable[tuple[Bits, int]]) -> UInt32:
    """Encode runs of bits to words.

    Args:
        runs: In decoding order, the bits of each run and the weight of a 1 bit (1 to
            2^24 - 1).

    Returns:
        Words in the order in which a section stores them.
    """
    if not HAS_CONSTRICTION:
        return np.array(ans.encode_bits(runs), dtype=np.uint32)
    coder = AnsCoder()
    for bits, weight in reversed(list(runs)):
        coder.encode_reverse(bits.astype(np.int32), _make_model(weight))
    words: UInt32 = coder.get_compressed()
    return words


def make_bit_decoder(words: UInt32) -> BitDecoder:
    """Make the decoder chosen with `use_bit_decoder`; if none was chosen, the fastest decoder.

    Raises:
        InvalidWordsError: No encoder can produce these words.
    """
    return (_decoder_override.get() or make_fastest_decoder)(words)


@contextmanager
def use_bit_decoder(make_decoder: Callable[[UInt32], BitDecoder] | None) -> Iterator[None]:
    """Make `make_bit_decoder` return a different decoder in a `with` block.

    Args:
        make_decoder: Function that makes the decoder of a section's words; None for the fastest
            decoder.
    """
    token = _decoder_override.set(make_decoder)
    try:
        yield
    finally:
        _decoder_override.reset(token)


def make_fastest_decoder(words: UInt32) -> BitDecoder:
    """Return constriction's decoder if constriction is installed, otherwise `PythonBitDecoder`.

    Raises:
        InvalidWordsError: No encoder can produce these words.
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
        bits: Bits = self._coder.decode(_make_model(weight), count).astype(np.bool_)
        return bits

    def finish(self) -> None:
        if not self._coder.is_empty():  # [8.3-2] [8.3-3]
            message = "words are left after the last bit"
            raise UnconsumedWordsError(message)


@lru_cache(maxsize=1 << 12)
def _make_model(weight: int) -> Any:  # noqa: ANN401, constriction has no types
    frequencies = np.array([WEIGHT_TOTAL - weight - 1, weight - 1], dtype=np.float64)
    return Categorical(frequencies, lazy=True)


_decoder_override: ContextVar[Callable[[UInt32], BitDecoder] | None] = ContextVar(
    "decoder_override", default=None
)
