import itertools
import zlib

import pytest

from quarc_ref.format import wire
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, LEVELS, MAGIC
from quarc_ref.format.container import build_chunk
from quarc_ref.format.errors import (
    BadMagicError,
    BadSyncError,
    BitstreamError,
    ChunkOrderError,
    ChunkSizeError,
    HeaderCrcError,
    PayloadCrcError,
    SequenceError,
    TrailingDataError,
    TruncatedError,
    UnknownCriticalError,
    UnsupportedVersionError,
)
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import ChunkReader, split_chunks
from quarc_ref.streams.source import BytesSource
from tests.small_streams import CountedSource, rebuild_stream

_HEAD = wire.build_stream_header(StreamHeader())
_HEAD_END = 8 + 24 + len(_HEAD)
_SMALL = rebuild_stream(
    [(b"HEAD", _HEAD), (b"meta", b""), (b"FRAM", b"third"), (b"abcd", b"odd"), (b"TAIL", b"last")]
)
_ENDS = [_HEAD_END + size for size in (0, 24, 53, 80, 108)]


def _forge_header(kind: bytes, length: int, sequence: int = 0) -> bytes:
    """Return a header with a correct CRC, whose payload is missing."""
    header = bytearray(build_chunk(kind, sequence, b"")[:CHUNK_HEADER_BYTES])
    header[12:16] = length.to_bytes(4, "little")
    header[16:20] = zlib.crc32(header[:16]).to_bytes(4, "little")
    return bytes(header)


def test_known_chunks_are_returned_with_their_positions():
    chunks = list(split_chunks(_SMALL))

    assert [chunk.kind for chunk in chunks] == [b"HEAD", b"meta", b"FRAM", b"TAIL"]
    assert [chunk.payload for chunk in chunks] == [_HEAD, b"", b"third", b"last"]
    assert [chunk.offset for chunk in chunks] == [8, _ENDS[0], _ENDS[1], _ENDS[3]]
    assert [chunk.sequence for chunk in chunks] == [0, 1, 2, 4]
    assert _ENDS[-1] == len(_SMALL)


def test_a_truncated_stream_gives_its_complete_chunks_and_an_error():
    for size in range(len(_SMALL)):
        complete_count = sum(end <= size for index, end in enumerate(_ENDS) if index != 3)
        chunks = split_chunks(_SMALL[:size])

        assert len(list(itertools.islice(chunks, complete_count))) == complete_count
        with pytest.raises(TruncatedError):
            next(chunks)


def test_a_reader_at_the_end_can_be_polled_again():
    class Growing(BytesSource):
        def read(self, offset, length):
            return super().read(offset, max(0, min(length, available - offset)))

    reader, kinds = ChunkReader(Growing(_SMALL)), []
    for available in range(len(_SMALL) + 1):
        try:
            kinds.append(reader.read_chunk().kind)
        except TruncatedError:
            assert available not in (_ENDS[0], _ENDS[1], _ENDS[2], _ENDS[4])

    assert kinds == [b"HEAD", b"meta", b"FRAM", b"TAIL"]
    assert reader.read_chunk() is None


def test_a_flipped_byte_is_detected_anywhere():
    for offset in range(len(_SMALL)):
        damaged = bytearray(_SMALL)
        damaged[offset] ^= 0x20

        with pytest.raises(BitstreamError):
            list(split_chunks(bytes(damaged)))


@pytest.mark.parametrize(
    ("damaged_offset", "error", "offset"),
    [
        (0, BadMagicError, 0),
        (8, BadSyncError, 8),
        (12, HeaderCrcError, 8),
        (24, HeaderCrcError, 8),
        (28, PayloadCrcError, 8),
        (_HEAD_END - 1, PayloadCrcError, 8),
        (_ENDS[3] - 5, PayloadCrcError, _ENDS[2]),
    ],
)
def test_the_error_depends_on_the_damaged_byte(damaged_offset, error, offset):
    damaged = bytearray(_SMALL)
    damaged[damaged_offset] ^= 1

    with pytest.raises(error) as caught:
        list(split_chunks(bytes(damaged)))
    assert caught.value.offset == offset


def test_bytes_after_the_tail_are_rejected():
    with pytest.raises(TrailingDataError):
        list(split_chunks(_SMALL + b"x"))


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (rebuild_stream([(b"CANO", b"")]), ChunkOrderError),
        (rebuild_stream([(b"HEAD", _HEAD), (b"HEAD", _HEAD)]), ChunkOrderError),
        (rebuild_stream([(b"HEAD", _HEAD), (b"INDX", b""), (b"meta", b"")]), ChunkOrderError),
        (MAGIC + build_chunk(b"HEAD", 1, _HEAD), SequenceError),
        (rebuild_stream([(b"HEAD", _HEAD)]) + build_chunk(b"meta", 2, b""), SequenceError),
        (rebuild_stream([(b"HEAD", _HEAD), (b"SNAP", b"")]), UnknownCriticalError),
        (rebuild_stream([(b"HEAD", b"\xff" * 100)]), UnsupportedVersionError),
    ],
)
def test_order_and_types_are_checked(data, error):
    with pytest.raises(error) as caught:
        list(split_chunks(data))
    assert caught.value.offset is not None


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (MAGIC + _forge_header(b"HEAD", (1 << 32) - 1), ChunkSizeError),
        (MAGIC + _forge_header(b"HEAD", 1025), ChunkSizeError),
        (MAGIC + _forge_header(b"HEAD", 1024), TruncatedError),
        (
            _SMALL[:_HEAD_END] + _forge_header(b"FRAM", LEVELS[10].chunk_bytes + 1, 1),
            ChunkSizeError,
        ),
        (
            _SMALL[:_HEAD_END] + _forge_header(b"abcd", LEVELS[10].chunk_bytes + 1, 1),
            ChunkSizeError,
        ),
        (_SMALL[:_HEAD_END] + _forge_header(b"FRAM", LEVELS[10].chunk_bytes, 1), TruncatedError),
    ],
)
def test_a_length_is_checked_against_the_level_before_the_payload_is_read(data, error):
    source = CountedSource(data + b"\0")

    with pytest.raises(error) as caught:
        list(split_chunks(source))

    payload_reads = [offset for offset, _ in source.reads if offset >= len(data)]
    assert bool(payload_reads) == (error is TruncatedError)
    assert caught.value.offset == len(data) - CHUNK_HEADER_BYTES


def test_the_crc_of_an_unknown_ancillary_chunk_is_checked_in_pieces():
    payload = bytes(range(256)) * 1024
    chunks = [(b"HEAD", _HEAD), (b"biGg".lower(), payload), (b"TAIL", b"")]
    data = rebuild_stream(chunks)
    source = CountedSource(data)

    assert [chunk.kind for chunk in split_chunks(source)] == [b"HEAD", b"TAIL"]
    assert max(length for _, length in source.reads) <= 1 << 16
    assert source.byte_count() >= len(payload)
    for offset in (_HEAD_END + 20, _HEAD_END + 20 + len(payload) - 1):
        damaged = bytearray(data)
        damaged[offset] ^= 1
        with pytest.raises(PayloadCrcError):
            list(split_chunks(bytes(damaged)))


def test_headers_can_be_walked_without_payloads():
    source = CountedSource(_SMALL)
    reader, kinds = ChunkReader(source), []
    reader.read_chunk()
    while (header := reader.read_header()) is not None:
        assert reader.read_header() == header
        kinds.append(header.kind)
        reader.skip(header)

    assert kinds == [b"meta", b"FRAM", b"abcd", b"TAIL"]
    assert all(length <= max(20, len(_HEAD) + 4) for _, length in source.reads)
