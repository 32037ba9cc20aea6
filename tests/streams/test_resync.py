import time
import zlib
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format import wire
from quarc_ref.format.constants import SYNC
from quarc_ref.format.container import build_chunk
from quarc_ref.format.errors import TruncatedError
from quarc_ref.format.records import Tail
from quarc_ref.streams import resync
from quarc_ref.streams.resync import (
    MAX_WINDOW_BYTES,
    ResumeConditions,
    ResumptionSearch,
    SearchBudget,
)
from tests.small_streams import CountedSource, GrowingSource

_CANO = build_chunk(b"CANO", 9, (30).to_bytes(4, "little") + b"rest of the frame")
_TAIL = build_chunk(b"TAIL", 9, wire.build_tail(Tail(3, 1, 0)))
_MEGABYTE = 1 << 20


def _find_resumption(data: bytes, **changes):
    conditions = {"offset": 0, "sequence": 5, "frame": 10, "max_payload_bytes": 1000} | changes
    conditions["budget"] = SearchBudget(conditions["max_payload_bytes"])
    return ResumptionSearch(CountedSource(data), ResumeConditions(**conditions)).find()


@given(st.binary(max_size=200), st.binary(max_size=200))
def test_a_canonical_chunk_is_found_in_any_junk(junk_before, junk_after):
    chunk = _find_resumption(junk_before + _CANO + junk_after)

    assert (chunk.offset, chunk.sequence) == (len(junk_before), 9)
    assert chunk.end - chunk.offset == len(_CANO)


@pytest.mark.parametrize("shift", [-len(_CANO), -20, -19, -4, -3, -1, 0, 1, 20])
def test_a_chunk_on_the_edge_of_a_window_is_found(shift):
    offset = MAX_WINDOW_BYTES + shift

    assert _find_resumption(bytes(offset) + _CANO).offset == offset


@pytest.mark.parametrize(
    "changes", [{"sequence": 10}, {"frame": 31}, {"max_payload_bytes": 20}, {"offset": 1}]
)
def test_a_chunk_type_that_cannot_follow_is_skipped(changes):
    assert _find_resumption(_CANO).offset == 0
    with pytest.raises(TruncatedError) as caught:
        _find_resumption(_CANO, **changes)
    assert caught.value.offset == len(_CANO)


def test_other_chunks_are_skipped():
    other_chunks = build_chunk(b"FRAM", 7, b"x" * 20) + build_chunk(b"CANO", 8, b"abc")

    assert _find_resumption(other_chunks + _CANO).offset == len(other_chunks)


def test_a_tail_is_accepted_only_at_the_very_end():
    assert _find_resumption(b"junk" + _TAIL).kind == b"TAIL"
    assert _find_resumption(_TAIL + b"junk" + _CANO).kind == b"CANO"
    assert _find_resumption(build_chunk(b"TAIL", 9, b"short") + _CANO).kind == b"CANO"


def test_a_damaged_or_truncated_chunk_is_skipped():
    damaged = _CANO[:-1] + bytes([_CANO[-1] ^ 1])

    assert _find_resumption(damaged + _CANO).offset == len(_CANO)
    assert _find_resumption(_CANO[:30] + _CANO).offset == 30
    with pytest.raises(TruncatedError):
        _find_resumption(_CANO[:-1])


def _forge_headers(count: int, length: int) -> bytes:
    """Return consecutive headers with correct CRCs, whose payloads are missing."""
    header = bytearray(build_chunk(b"CANO", 9, b"")[:16])
    header[12:16] = length.to_bytes(4, "little")
    return (bytes(header) + zlib.crc32(header).to_bytes(4, "little")) * count


@pytest.mark.parametrize(
    ("junk", "seconds"),
    [
        (bytes(_MEGABYTE), 0.5),
        (SYNC * (_MEGABYTE // 4), 1),
        (SYNC[:1] * _MEGABYTE, 0.5),
        (_forge_headers(_MEGABYTE // 20, 0), 4),
        (_forge_headers(_MEGABYTE // 20, _MEGABYTE // 2), 4),
        (_forge_headers(_MEGABYTE // 20, _MEGABYTE * 3), 4),
    ],
    ids=["zeros", "sync words", "half sync words", "headers", "long headers", "longer headers"],
)
def test_a_megabyte_of_junk_is_skipped_quickly(junk, seconds):
    source = CountedSource(junk + bytes(_MEGABYTE) + _CANO)
    start_time = time.process_time()

    chunk = ResumptionSearch(
        source, ResumeConditions(0, 5, 10, 4 * _MEGABYTE, SearchBudget(4 * _MEGABYTE))
    ).find()

    assert chunk.offset == len(junk) + _MEGABYTE
    assert time.process_time() - start_time < seconds
    assert source.byte_count() < 200 * _MEGABYTE


def test_the_ordinal_of_a_frame_is_its_first_field():
    assert resync.parse_ordinal((1 << 31).to_bytes(4, "little") + b"more") == 1 << 31


class _RecordedBudget(SearchBudget):
    """A budget that records what was charged."""

    def __init__(self, max_payload_bytes):
        super().__init__(max_payload_bytes)
        self.charges = []

    def spend(self, byte_count):
        self.charges.append(byte_count)
        super().spend(byte_count)


def _search_while_growing(data, first_bytes=0):
    """Search a stream that grows; return the chunk, the budget and the bytes that were read."""
    source, budget = GrowingSource(data, first_bytes), _RecordedBudget(1000)
    search = ResumptionSearch(source, ResumeConditions(0, 5, 10, 1000, budget), is_growing=True)
    while True:
        with suppress(TruncatedError):
            return search.find(), budget, source.byte_count()
        source.wait()


def test_only_chunks_that_are_complete_and_damaged_are_charged_and_only_once():
    damaged = _CANO[:-1] + bytes([_CANO[-1] ^ 1])
    data = damaged + b"junk" + build_chunk(b"CANO", 9, (9).to_bytes(4, "little")) + _CANO

    chunk, budget, _ = _search_while_growing(data)

    assert chunk.offset == len(data) - len(_CANO)
    assert budget.charges == [len(_CANO) - 24, 4]


@pytest.mark.parametrize("first_bytes", [0, 3, 19, 20, 5000])
def test_a_search_in_a_growing_stream_continues_where_it_ended(first_bytes):
    junk = bytes(6000)
    long_chunk = build_chunk(b"CANO", 9, (30).to_bytes(4, "little") + bytes(900))

    chunk, budget, byte_count = _search_while_growing(junk + long_chunk, first_bytes)

    assert (chunk.offset, budget.charges) == (len(junk), [])
    assert byte_count < 40 * len(junk)


def test_a_chunk_within_an_incomplete_chunk_does_not_wait_for_it():
    data = _forge_headers(1, 900) + b"junk" + _CANO

    chunk, budget, _ = _search_while_growing(data)

    assert (chunk.offset, budget.charges) == (24, [])


def test_an_incomplete_chunk_of_a_stream_that_does_not_grow_is_charged():
    budget = _RecordedBudget(1000)
    with pytest.raises(TruncatedError):
        ResumptionSearch(CountedSource(_CANO[:-1]), ResumeConditions(0, 5, 10, 1000, budget)).find()

    assert budget.charges == [len(_CANO) - 24]
