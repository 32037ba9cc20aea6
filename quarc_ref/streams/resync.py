"""Finds the first chunk after damage at which decoding can resume (SPEC 11.4).

A search checks every sync word once. The bytes of payloads whose CRC fails are charged to a
`SearchBudget`, which all searches of a stream share. The total time of all searches is
therefore proportional to the size of the stream, even if damaged bytes look like chunks.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain

from quarc_ref.format import container
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, LEVELS, SYNC, TAIL_BYTES
from quarc_ref.format.container import ChunkHeader
from quarc_ref.format.errors import FieldError, PayloadCrcError, TruncatedError
from quarc_ref.streams.chunk_reader import check_payload_crc
from quarc_ref.streams.source import Source

MAX_WINDOW_BYTES = 1 << 20
_FIRST_WINDOW_BYTES = 1 << 12  # small, because the next chunk is often near
_BUDGET_FACTOR = 16
_MAX_BUDGETED_PAYLOAD_BYTES = LEVELS[30].chunk_bytes
ORDINAL_BYTES = 4


class SearchBudget:
    """Limits the number of payload bytes that searches check in vain (SPEC 11.4, 13-2).

    Args:
        max_payload_bytes: Largest payload that the stream's level allows.
    """

    def __init__(self, max_payload_bytes: int) -> None:
        self._base_budget = _BUDGET_FACTOR * min(max_payload_bytes, _MAX_BUDGETED_PAYLOAD_BYTES)
        self._spent_bytes = 0

    def spend(self, byte_count: int) -> None:
        """Count the bytes of a payload whose CRC failed."""
        self._spent_bytes += byte_count

    def allows(self, offset: int) -> bool:
        """Return whether a payload at an offset of the stream may still be checked."""
        return self._spent_bytes <= _BUDGET_FACTOR * offset + self._base_budget


@dataclass(frozen=True, slots=True)
class ResumeConditions:
    """Conditions that a chunk must meet for decoding to resume at it.

    Attributes:
        offset: Offset of the first byte to check.
        sequence: Minimum sequence number of the chunk.
        frame: Minimum ordinal of the frame.
        max_payload_bytes: Largest payload that the stream's level allows.
        budget: Search budget that all searches in the stream share.
        canonical: Ordinal of the CANO to which a snapshot must refer; None to accept no snapshots.
    """

    offset: int
    sequence: int
    frame: int
    max_payload_bytes: int
    budget: SearchBudget
    canonical: int | None = None

    def matches_header(self, header: ChunkHeader) -> bool:
        """Return whether a chunk meets the conditions on its header."""
        if header.sequence < self.sequence or header.length > self.max_payload_bytes:
            return False
        if header.kind == container.TAIL:
            return header.length == TAIL_BYTES
        if header.kind == container.SNAP:
            return self.canonical is not None and header.length >= 2 * ORDINAL_BYTES
        return header.kind == container.CANO and header.length >= ORDINAL_BYTES

    def matches_payload(self, header: ChunkHeader, source: Source) -> bool:
        """Return whether the payload of a chunk with a matching header meets the conditions."""
        if header.kind == container.TAIL:
            return not source.read(header.end, 1)
        payload = source.read(header.payload_offset, 2 * ORDINAL_BYTES)
        if header.kind == container.SNAP and parse_ordinal(payload[ORDINAL_BYTES:]) != (
            self.canonical
        ):
            return False
        return parse_ordinal(payload) >= self.frame  # [11.4-1]


def parse_ordinal(payload: bytes) -> int:
    """Return the frame number at the start of a CANO or SNAP payload (SPEC 5.4)."""
    return int.from_bytes(payload[:ORDINAL_BYTES], "little")


def read_ordinals(source: Source, header: ChunkHeader, count: int) -> list[int]:
    """Read the frame numbers at the start of a payload: one of a CANO, two of a SNAP.

    Args:
        source: The stream.
        header: Header of the chunk.
        count: Number of frame numbers.

    Raises:
        FieldError: The payload is too short.
        TruncatedError: The stream ends inside the frame numbers.
    """
    byte_count = count * ORDINAL_BYTES
    if header.length < byte_count:
        message = f"a payload of {header.length} bytes is too short for a frame number"
        raise FieldError(message, header.offset)
    data = source.read(header.payload_offset, byte_count)
    if len(data) < byte_count:
        message = "the stream ends inside a chunk"
        raise TruncatedError(message, header.offset)
    return [parse_ordinal(data[start:]) for start in range(0, byte_count, ORDINAL_BYTES)]


class ResumptionSearch:
    """Finds the first chunk at which decoding can resume: a CANO, a SNAP or the final TAIL.

    In a growing stream, `find` can be called again once the stream has grown. The search then
    continues where it ended, so no chunk is charged to the budget twice.

    Args:
        source: The stream.
        conditions: Conditions on the chunk.
        is_growing: Whether the stream may grow. A chunk that the stream does not contain
            completely is then not charged, but checked once it is complete.
    """

    def __init__(
        self, source: Source, conditions: ResumeConditions, *, is_growing: bool = False
    ) -> None:
        self._source, self._conditions, self._is_growing = source, conditions, is_growing
        self._offset = conditions.offset  # start of the next window
        self._end = conditions.offset  # end of the last window
        self._window_bytes = _FIRST_WINDOW_BYTES
        self._incomplete: list[ChunkHeader] = []  # chunks to check once they are complete
        self._missing_end: int | None = None  # smallest chunk end known to be beyond the stream

    def find(self) -> ChunkHeader:
        """Find the chunk; see the class.

        Raises:
            TruncatedError: There is no such chunk; the error's offset is the end of the stream.
        """
        earlier, self._incomplete, self._missing_end = self._incomplete, [], None
        for header in chain(earlier, self._new_headers()):
            if not self._conditions.budget.allows(header.offset):
                continue
            if self._is_growing and self._is_missing(header.end):
                self._incomplete.append(header)
                continue
            with suppress(PayloadCrcError, TruncatedError):
                check_payload_crc(self._source, header)
                if self._conditions.matches_payload(header, self._source):
                    return header
            self._conditions.budget.spend(header.length)
        message = "the stream ends without a chunk at which decoding can resume"
        raise TruncatedError(message, self._end)

    def _new_headers(self) -> Iterator[ChunkHeader]:
        """Yield the matching headers up to the end of the stream that were not yielded before."""
        has_more = True
        while has_more:
            window = self._source.read(self._offset, self._window_bytes)
            for header in _find_headers(window, self._offset):
                if self._conditions.matches_header(header):
                    yield header
            has_more = len(window) == self._window_bytes
            self._end = self._offset + len(window)
            self._offset += max(0, len(window) - CHUNK_HEADER_BYTES + 1)
            self._window_bytes = min(2 * self._window_bytes, MAX_WINDOW_BYTES)

    def _is_missing(self, end: int) -> bool:
        """Return whether the stream does not have the byte before `end` yet."""
        if self._missing_end is not None and end >= self._missing_end:
            return True
        if self._source.read(end - 1, 1):
            return False
        self._missing_end = end
        return True


def _find_headers(window: bytes, start: int) -> Iterator[ChunkHeader]:
    """Yield the headers with valid CRCs in a window, which begins at byte `start` of the stream."""
    offset = window.find(SYNC)
    while 0 <= offset <= len(window) - CHUNK_HEADER_BYTES:
        data = window[offset : offset + CHUNK_HEADER_BYTES]
        if container.is_header_crc_valid(data):
            yield container.parse_header(data, start + offset)
        offset = window.find(SYNC, offset + 1)
