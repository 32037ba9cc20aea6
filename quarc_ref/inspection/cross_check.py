"""Decodes every section with both entropy decoders and compares their results.

The fast decoder and the decoder in plain Python must return the same bits, or reject the words
with the same reject id.
"""

from collections.abc import Callable
from typing import NoReturn, TypeVar

import numpy as np

from quarc_ref.format.arrays import Bits, UInt32
from quarc_ref.format.coding.ans import PythonBitDecoder
from quarc_ref.format.coding.entropy import BitDecoder, make_fastest_decoder
from quarc_ref.format.errors import BitstreamError, VerificationError

_Result = TypeVar("_Result")


class CrossChecker:
    """Runs both entropy decoders on every section, and counts sections and bits.

    Attributes:
        section_count: Number of sections for which `make_decoder` was called.
        bit_count: Number of bits on which both decoders agreed.
    """

    def __init__(self) -> None:
        self.section_count = 0
        self.bit_count = 0

    def make_decoder(self, words: UInt32) -> BitDecoder:
        """Return a decoder that runs both decoders on `words` and compares their results.

        Raises:
            InvalidWordsError: Both decoders reject the words.
            VerificationError: Only one decoder rejects the words, or their reject ids differ.
        """
        fast, plain = _run_both(
            lambda: make_fastest_decoder(words), lambda: PythonBitDecoder(words)
        )
        self.section_count += 1
        return _CrossCheckingBitDecoder(fast, plain, self)


class _CrossCheckingBitDecoder:
    def __init__(self, fast: BitDecoder, plain: BitDecoder, checker: CrossChecker) -> None:
        self._fast = fast
        self._plain = plain
        self._checker = checker

    def take(self, count: int, weight: int) -> Bits:
        bits = self._fast.take(count, weight)
        if not np.array_equal(bits, self._plain.take(count, weight)):
            _raise_disagreement()
        self._checker.bit_count += count
        return bits

    def finish(self) -> None:
        _run_both(self._fast.finish, self._plain.finish)


def _run_both(fast: Callable[[], _Result], plain: Callable[[], _Result]) -> tuple[_Result, _Result]:
    """Return both results; raise their common error, or VerificationError if they disagree."""
    results: list[_Result] = []
    errors: list[BitstreamError] = []
    for action in (fast, plain):
        try:
            results.append(action())
        except BitstreamError as error:
            errors.append(error)
    if not errors:
        return results[0], results[1]
    if results or errors[0].reject_id != errors[1].reject_id:
        _raise_disagreement()
    raise errors[0]


def _raise_disagreement() -> NoReturn:
    message = "the two entropy decoders disagree on a section"
    raise VerificationError(message)
