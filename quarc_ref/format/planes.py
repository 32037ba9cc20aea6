"""Planes of bits in contexts, and the sections that hold them: SPEC 8.1.

A plane asks one yes-or-no question of many elements at once; each element has
a context. All bits of a plane that share a context form one run of the coder
under one probability, whose code is a byte of the section's table.

Each walk over the planes of a section is written once, for both directions. A
`PlaneWriter` gives back the answers it is handed; a `PlaneReader` takes no
notice of what it is handed and gives the answers of the section. A walk must
go on from what it was given back.
"""

from typing import Protocol

import numpy as np

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import WEIGHT_TOTAL
from quarc_ref.format.entropy import encode_bits, open_words
from quarc_ref.format.errors import TableLengthError
from quarc_ref.format.probability import choose_code, weight_of_code
from quarc_ref.format.records import Section

_EVEN = WEIGHT_TOTAL // 2


class Planes(Protocol):
    """One direction of a walk over planes."""

    def code(self, contexts: Int64, bits: Bits) -> Bits:
        """Code one plane.

        Args:
            contexts: `[n]` context of each element, 0 or more.
            bits: `[n]` the answers; any bits when reading.

        Returns:
            `[n]` the answers.

        Raises:
            BitstreamError: When reading, the section is malformed.
        """
        ...

    def code_raw(self, bits: Bits) -> Bits:
        """Code bits that are as likely 0 as 1, without an entry of the table."""
        ...


class PlaneWriter:
    """Gathers planes and makes a section of them."""

    def __init__(self) -> None:
        self._table = bytearray()
        self._runs: list[tuple[Bits, int]] = []

    def code(self, contexts: Int64, bits: Bits) -> Bits:
        """See `Planes.code`."""
        for run in _runs_of(contexts):
            taken = bits[run]
            code = choose_code(int(np.count_nonzero(taken)), taken.size)
            self._table.append(code)
            self._runs.append((taken, weight_of_code(code)))
        return bits

    def code_raw(self, bits: Bits) -> Bits:
        """See `Planes.code_raw`."""
        self._runs.append((bits, _EVEN))
        return bits

    def section(self) -> Section:
        """Return what was written."""
        return Section(bytes(self._table), encode_bits(self._runs))


class PlaneReader:
    """Gives back the planes of a section.

    Args:
        section: As a chunk holds it, its CRC checked.

    Raises:
        InvalidWordsError: No encoder writes such words.
    """

    def __init__(self, section: Section) -> None:
        self._table = iter(section.table)
        self._words = open_words(section.words)

    def code(self, contexts: Int64, bits: Bits) -> Bits:
        """See `Planes.code`."""
        answers = np.zeros_like(bits)
        for run in _runs_of(contexts):
            code = next(self._table, None)
            if code is None:
                message = "the table ends before the planes do"
                raise TableLengthError(message)
            answers[run] = self._words.take(run.size, weight_of_code(code))
        return answers

    def code_raw(self, bits: Bits) -> Bits:
        """See `Planes.code_raw`."""
        return self._words.take(bits.size, _EVEN)

    def finish(self) -> None:
        """Refuse what the planes have not used.

        Raises:
            TableLengthError: Entries of the table are left.
            UnconsumedWordsError: Words are left.
        """
        if next(self._table, None) is not None:
            message = "the table goes on after the last plane"
            raise TableLengthError(message)
        self._words.finish()


def _runs_of(contexts: Int64) -> list[Int64]:
    """Return the indices of each context's elements, contexts ascending."""
    order = np.argsort(contexts, kind="stable")
    borders = np.flatnonzero(np.diff(contexts[order])) + 1
    return np.split(order, borders) if order.size else []
