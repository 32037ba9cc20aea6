"""The planes of a section, read by `plane_kernels`."""

from types import ModuleType
from typing import Final

import numpy as np

from quarc_ref.format.arrays import Bits, Int16, Int64
from quarc_ref.format.constants import COUNT_LIMIT, MODELLED_BITS, PROBABILITY_CODES
from quarc_ref.format.contexts import ContextCounts
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError
from quarc_ref.format.probability import weight_of_code
from quarc_ref.format.records import Section


class CompiledPlaneReader:
    """Does as `planes.PlaneReader`.

    Args:
        section: As a chunk holds it, its CRC checked.
        counts: What contexts have seen before; it stays as it is.
        kernels: Those of `plane_kernels`, `value_kernels` and `level_kernels`.

    Raises:
        InvalidWordsError: No encoder writes such words.
    """

    def __init__(
        self, section: Section, counts: ContextCounts, kernels: tuple[ModuleType, ...]
    ) -> None:
        self._counts = counts.copy()
        self._kernels, self._values, self._levels = kernels
        words = np.array(section.words, dtype=np.uint32)
        self._cursor = np.zeros(2, dtype=np.uint64)
        if words.size:
            self._cursor[:] = words[-1], words.size - 1
            if words[-1] == 0:
                message = "the last word is 0"
                raise InvalidWordsError(message)
        self._coder = (words, self._cursor, COUNT_LIMIT, _CODE_WEIGHTS)

    def code(self, model: str, contexts: Int64, bits: Bits) -> Bits:
        """See `planes.Planes.code`."""
        if contexts.size == 0:
            return bits
        counts = self._counts.open(model, int(contexts.max()))
        answers: Bits
        contexts = np.ascontiguousarray(contexts)
        answers, undefined = self._kernels.read_plane(self._coder, contexts, counts)
        _refuse(undefined)
        return answers

    def code_raw(self, bits: Bits) -> Bits:
        """See `planes.Planes.code_raw`."""
        answers: Bits = self._kernels.read_raw(self._coder, bits.size)
        return answers

    def read_fixed(self, name: str, contexts: Int64, width: int) -> Int64:
        """Do as `values.code_fixed`."""
        if contexts.size == 0:
            return contexts
        counts = self._counts.open(f"{name}, class", ((int(contexts.max()) + 1) << width) - 1)
        return self._read_numbers(contexts, width, self._values.FIXED, (counts, counts, counts))

    def read_classed(self, name: str, contexts: Int64, class_bits: int, *, signed: bool) -> Int64:
        """Do as `values.code_signed`, or as `values.code_unsigned`."""
        if contexts.size == 0:
            return contexts
        classes = (int(contexts.max()) + 1) << class_bits
        mantissas = classes << (MODELLED_BITS + signed)
        counts = (
            self._counts.open(f"{name}, class", classes - 1),
            self._counts.open(f"{name}, sign", classes - 1),
            self._counts.open(f"{name}, mantissa", mantissas - 1),
        )
        form = self._values.SIGNED if signed else self._values.UNSIGNED
        return self._read_numbers(contexts, class_bits, form, counts)

    def _read_numbers(
        self, contexts: Int64, width: int, form: int, counts: tuple[Int64, Int64, Int64]
    ) -> Int64:
        numbers: Int64
        numbers, undefined = self._values.read_numbers(self._coder, contexts, width, form, counts)
        _refuse(undefined)
        return numbers

    def read_level(
        self, name: str, parents: Int64, previous: Int16, above: tuple[Int64, Int64]
    ) -> Int64:
        """Do as a walk of `motion_planes` over a level.

        Args:
            name: Of the level.
            parents: `[a]` of its anchors.
            previous: `[c, a]` the last motion of each anchor's Gaussian.
            above: `[c, p]` what is done at each parent, and `[p]` the sum of
                the magnitudes of its symbols.

        Returns:
            `[c, a]` symbols.
        """
        counts = tuple(
            self._counts.open(f"{name}, {question}", contexts - 1)
            for question, contexts in _QUESTIONS.items()
        )
        symbols: Int64
        symbols, undefined = self._levels.read_level(
            self._coder, parents, np.ascontiguousarray(previous, np.int16), above, counts
        )
        _refuse(undefined)
        return symbols

    def finish(self) -> ContextCounts:
        """See `planes.PlaneReader.finish`."""
        if self._cursor.any():
            message = "words are left after the last bit"
            raise UnconsumedWordsError(message)
        return self._counts


def _refuse(undefined: int) -> None:
    """Raise BadProbabilityError for a probability code that is undefined; -1 is none."""
    if undefined >= 0:
        weight_of_code(undefined)


# The questions asked of a level's anchors (SPEC 8.7), and how many contexts each may have.
_QUESTIONS: Final = {
    "moves": 20,
    "translation not 0": 16,
    "w not 0": 16,
    "rotation not 0": 16,
    "sign": 9,
    "magnitude": 33,
}
_CODE_WEIGHTS: Final = np.array([weight_of_code(code) for code in range(PROBABILITY_CODES)])
