import itertools
import zlib

import pytest

from quarc_ref.format.constants import CHUNK_HEADER_BYTES, MAGIC
from quarc_ref.format.container import build_chunk, split_chunks
from quarc_ref.format.errors import (
    BadChunkTypeError,
    BadMagicError,
    BadSyncError,
    BitstreamError,
    ChunkOrderError,
    HeaderCrcError,
    PayloadCrcError,
    SequenceError,
    TrailingDataError,
    TruncatedError,
    UnknownCriticalError,
)


def _stream(*chunks, start=0):
    numbered = zip(itertools.count(start), chunks, strict=False)
    return MAGIC + b"".join(
        build_chunk(kind, number, payload) for number, (kind, payload) in numbered
    )


_SMALL = _stream((b"HEAD", b"first"), (b"meta", b""), (b"FRAM", b"third"), (b"TAIL", b"last"))


def test_chunks_come_out_with_their_places():
    chunks = list(split_chunks(_SMALL))

    assert [chunk.kind for chunk in chunks] == [b"HEAD", b"meta", b"FRAM", b"TAIL"]
    assert [chunk.payload for chunk in chunks] == [b"first", b"", b"third", b"last"]
    assert [chunk.offset for chunk in chunks] == [8, 37, 61, 90]
    assert sum(chunk.byte_count() for chunk in chunks) + len(MAGIC) == len(_SMALL)


def test_a_stream_that_is_cut_gives_its_whole_chunks_and_says_so():
    for size in range(len(_SMALL)):
        whole = [offset for offset in (37, 61, 90, 118) if offset <= size]
        chunks = split_chunks(_SMALL[:size])

        assert [next(chunks).offset for _ in whole] == [8, 37, 61, 90][: len(whole)]
        with pytest.raises(TruncatedError):
            next(chunks)


def test_a_flipped_byte_is_found_wherever_it_is():
    for place in range(len(_SMALL)):
        damaged = bytearray(_SMALL)
        damaged[place] ^= 0x20

        with pytest.raises(BitstreamError):
            list(split_chunks(bytes(damaged)))


@pytest.mark.parametrize(
    ("place", "error"),
    [
        (0, BadMagicError),
        (8, BadSyncError),
        (12, HeaderCrcError),
        (24, HeaderCrcError),
        (28, PayloadCrcError),
        (33, PayloadCrcError),
    ],
)
def test_damage_has_a_name_by_its_place(place, error):
    damaged = bytearray(_SMALL)
    damaged[place] ^= 1

    with pytest.raises(error) as caught:
        list(split_chunks(bytes(damaged)))
    assert caught.value.offset == (0 if place == 0 else 8)


def test_bytes_after_the_tail_are_refused():
    with pytest.raises(TrailingDataError):
        list(split_chunks(_SMALL + b"x"))


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (_stream((b"CANO", b"")), ChunkOrderError),
        (_stream((b"HEAD", b""), (b"HEAD", b"")), ChunkOrderError),
        (_stream((b"HEAD", b""), start=1), SequenceError),
        (_stream((b"HEAD", b""), (b"SNAP", b"")), UnknownCriticalError),
        (_stream((b"HEAD", b""), (b"SNaP", b"")), BadChunkTypeError),
        (_stream((b"HEAD", b""), (b"me1a", b"")), BadChunkTypeError),
    ],
)
def test_order_and_types_are_minded(data, error):
    with pytest.raises(error):
        list(split_chunks(data))


@pytest.mark.parametrize("kind", [b"abcd", b"aBcd", b"zZzz"])
def test_unknown_ancillary_chunks_are_let_pass(kind):
    data = _stream((b"HEAD", b""), (kind, b"whatever"), (b"TAIL", b""))

    assert [chunk.kind for chunk in split_chunks(data)] == [b"HEAD", kind, b"TAIL"]


def test_a_length_of_four_billion_is_a_truncation_and_allocates_nothing():
    header = bytearray(build_chunk(b"HEAD", 0, b"")[:CHUNK_HEADER_BYTES])
    header[12:16] = b"\xff" * 4
    header[16:20] = zlib.crc32(header[:16]).to_bytes(4, "little")

    with pytest.raises(TruncatedError):
        list(split_chunks(MAGIC + bytes(header)))
