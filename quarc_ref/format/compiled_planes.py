"""The planes of a section, read by `plane_kernels`."""

from types import ModuleType
from typing import Final

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import COUNT_LIMIT, PROBABILITY_CODES
from quarc_ref.format.contexts import ContextCounts
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError
from quarc_ref.format.probability import weight_of_code
from quarc_ref.format.records import Section


class CompiledPlaneReader:
    """Does as `planes.PlaneReader`.

    Args:
        section: As a chunk holds it, its CRC checked.
        counts: What contexts have seen before; it stays as it is.
        kernels: Those of `plane_kernels`.

    Raises:
        InvalidWordsError: No encoder writes such words.
    """

    def __init__(self, section: Section, counts: ContextCounts, kernels: ModuleType) -> None:
        self._counts = counts.copy()
        self._kernels = kernels
        self._words = np.array(section.words, dtype=np.uint32)
        self._cursor = np.zeros(2, dtype=np.uint64)
        if self._words.size:
            self._cursor[:] = self._words[-1], self._words.size - 1
            if self._words[-1] == 0:
                message = "the last word is 0"
                raise InvalidWordsError(message)

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """See `planes.Planes.code`."""
        if contexts.size == 0:
            return bits
        counts = self._counts.open(model, int(contexts.max()))
        answers: Bits
        answers, undefined = self._kernels.read_plane(
            self._words,
            self._cursor,
            np.ascontiguousarray(contexts),
            counts,
            COUNT_LIMIT,
            _CODE_WEIGHTS,
        )
        if undefined >= 0:
            weight_of_code(undefined)
        return answers

    def code_raw(self, bits: Bits) -> Bits:
        """See `planes.Planes.code_raw`."""
        answers: Bits = self._kernels.read_raw(self._words, self._cursor, bits.size)
        return answers

    def finish(self) -> ContextCounts:
        """See `planes.PlaneReader.finish`."""
        if self._cursor.any():
            message = "words are left after the last bit"
            raise UnconsumedWordsError(message)
        return self._counts


_CODE_WEIGHTS: Final = np.array([weight_of_code(code) for code in range(PROBABILITY_CODES)])
