import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format import container
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, HEAD_BYTES_LIMIT, LEVELS
from quarc_ref.format.container import (
    Chunk,
    ChunkHeader,
    build_chunk,
    check_length,
    check_order,
    check_type,
    make_chunk,
    parse_header,
)
from quarc_ref.format.errors import (
    BadChunkTypeError,
    BadSyncError,
    ChunkOrderError,
    ChunkSizeError,
    HeaderCrcError,
    PayloadCrcError,
    TruncatedError,
    UnknownCriticalError,
)
from quarc_ref.format.records import StreamHeader

_UINT32 = st.integers(0, (1 << 32) - 1)


@given(st.binary(min_size=4, max_size=4), _UINT32, st.binary(max_size=50), st.integers(0, 1 << 40))
def test_a_chunk_survives_a_round_trip(kind, sequence, payload, offset):
    data = build_chunk(kind, sequence, payload)

    header = parse_header(data[:CHUNK_HEADER_BYTES], offset)
    chunk = make_chunk(header, data[CHUNK_HEADER_BYTES:])

    assert header == ChunkHeader(kind, sequence, len(payload), offset)
    assert header.end - offset == chunk.byte_count() == len(data)
    assert chunk == Chunk(kind, payload, offset, sequence)


def test_a_header_is_reported_as_truncated_or_damaged():
    header = build_chunk(b"meta", 3, b"")[:CHUNK_HEADER_BYTES]

    for size in range(CHUNK_HEADER_BYTES):
        with pytest.raises(TruncatedError):
            parse_header(header[:size], 5)
        damaged = bytearray(header)
        damaged[size] ^= 1
        error = BadSyncError if size < 4 else HeaderCrcError
        with pytest.raises(error) as caught:
            parse_header(bytes(damaged), 5)
        assert caught.value.offset == 5
        with pytest.raises(BadSyncError if size < 4 else TruncatedError):
            parse_header(bytes(damaged)[: size + 1][:19], 5)


def test_a_payload_is_reported_as_truncated_or_damaged():
    data = build_chunk(b"meta", 3, b"payload")
    header, body = parse_header(data[:CHUNK_HEADER_BYTES], 5), data[CHUNK_HEADER_BYTES:]

    for size in range(len(body)):
        with pytest.raises(TruncatedError) as caught:
            make_chunk(header, body[:size])
        assert caught.value.offset == 5
        damaged = bytearray(body)
        damaged[size] ^= 1
        with pytest.raises(PayloadCrcError):
            make_chunk(header, bytes(damaged))


def test_a_header_crc_covers_the_sixteen_bytes_before_it():
    header = build_chunk(b"FRAM", 9, b"x")[:CHUNK_HEADER_BYTES]

    assert header[16:] == zlib.crc32(header[:16]).to_bytes(4, "little")


def _find_rejection(kind: bytes, header: StreamHeader | None = None) -> type[Exception] | None:
    try:
        check_type(ChunkHeader(kind, 1, 0, 0), header)
    except (BadChunkTypeError, UnknownCriticalError) as error:
        return type(error)
    return None


@pytest.mark.parametrize(
    ("kinds", "error"),
    [
        ([kind for kind in container.KNOWN_TYPES if kind != container.SNAP], None),
        ([b"abcd", b"aBcd", b"zZzz", b"indx"], None),
        ([b"SNAP", b"SnAP", b"CaNO", b"ZZZZ"], UnknownCriticalError),
        ([b"SNaP", b"SNAp", b"me1a", b"\0\0\0\0", b"meT\xe4", b"mETA"], BadChunkTypeError),
    ],
)
def test_the_case_of_letters_classifies_types(kinds, error):
    assert [_find_rejection(kind) for kind in kinds] == [error] * len(kinds)


def test_snapshots_are_known_only_in_streams_that_declare_them():
    assert _find_rejection(container.SNAP, StreamHeader()) is UnknownCriticalError
    assert _find_rejection(container.SNAP, StreamHeader(snapshots=True)) is None


@pytest.mark.parametrize(
    ("kind", "sequence", "previous_kind", "is_allowed"),
    [
        (b"HEAD", 0, b"", True),
        (b"HEAD", 1, b"HEAD", False),
        (b"CANO", 0, b"", False),
        (b"INDX", 5, b"FRAM", True),
        (b"TAIL", 6, b"INDX", True),
        (b"TAIL", 6, b"FRAM", True),
        (b"INDX", 6, b"INDX", False),
        (b"meta", 6, b"INDX", False),
        (b"FRAM", 6, b"INDX", False),
    ],
)
def test_head_is_first_and_tail_follows_indx(kind, sequence, previous_kind, is_allowed):
    header = ChunkHeader(kind, sequence, 0, 77)
    if is_allowed:
        check_order(header, previous_kind)
        return
    with pytest.raises(ChunkOrderError) as caught:
        check_order(header, previous_kind)
    assert caught.value.offset == 77


@pytest.mark.parametrize("level", [10, 20, 30])
def test_a_level_limits_payloads(level):
    limit = LEVELS[level].chunk_bytes

    check_length(limit, StreamHeader(level=level), 0)
    with pytest.raises(ChunkSizeError):
        check_length(limit + 1, StreamHeader(level=level), 0)


def test_the_header_of_a_stream_is_limited_before_its_level_is_known():
    check_length(HEAD_BYTES_LIMIT, None, 0)
    with pytest.raises(ChunkSizeError):
        check_length(HEAD_BYTES_LIMIT + 1, None, 0)
