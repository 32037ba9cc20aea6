import io

import pytest

from quarc_ref.format import wire
from quarc_ref.format.constants import LEVELS, Level
from quarc_ref.format.records import SeekPoint, StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.stream_writer import StreamWriter
from tests.small_streams import make_stream

_DATA, _ = make_stream(gaussian_count=8, frame_count=5, canonical_every=2)
_CHUNKS = list(split_chunks(_DATA))
_BODY = _CHUNKS[1:-2]


class _Sink(io.BytesIO):
    """Records the number of bytes written before each flush."""

    def __init__(self):
        super().__init__()
        self.flushed = []

    def flush(self):
        self.flushed.append(len(self.getvalue()))


def _write(sink, body, check=None):
    writer = StreamWriter(sink, _CHUNKS[0].payload, check)
    for chunk in body:
        writer.write(chunk.kind, chunk.payload)
    return writer


def test_rewriting_the_chunks_of_a_stream_reproduces_it():
    sink = io.BytesIO()
    writer = _write(sink, _BODY)
    writer.finish()

    assert sink.getvalue() == _DATA
    assert (writer.offset, writer.sequence) == (len(_DATA), len(_CHUNKS))
    assert writer.frame_count == 5


@pytest.mark.parametrize("count", range(1, len(_BODY) + 2))
def test_chunks_that_are_already_in_the_sink_are_counted_and_not_written(count):
    existing_bytes = _CHUNKS[count].offset
    sink = io.BytesIO(_DATA[:existing_bytes])
    sink.seek(existing_bytes)
    writer = StreamWriter(sink, _CHUNKS[0].payload, existing_bytes=existing_bytes)
    for chunk in _BODY:
        writer.write(chunk.kind, chunk.payload)
    writer.finish()

    assert sink.getvalue() == _DATA


def test_every_chunk_is_flushed_completely():
    sink = _Sink()
    _write(sink, _BODY).finish()

    assert sink.flushed == [chunk.offset + chunk.byte_count() for chunk in _CHUNKS]


def test_chunks_are_checked_as_by_the_reader_before_they_are_written():
    sink, checked_chunks = io.BytesIO(), []

    def check(chunk):
        assert len(sink.getvalue()) == (chunk.offset if checked_chunks else 0)
        checked_chunks.append(chunk)

    _write(sink, _BODY, check).finish()

    assert checked_chunks == _CHUNKS


@pytest.mark.parametrize("rejected_index", [0, 3, len(_CHUNKS) - 2])
def test_a_rejected_chunk_is_not_written_and_changes_nothing(rejected_index):
    sink, verdicts = io.BytesIO(), iter([*[True] * rejected_index, False])

    def check(_chunk):
        if not next(verdicts, True):
            raise KeyError

    if rejected_index == 0:
        with pytest.raises(KeyError):
            StreamWriter(sink, _CHUNKS[0].payload, check)
        assert sink.getvalue() == b""
        return
    accepted_chunks = _BODY[: rejected_index - 1]
    writer = _write(sink, accepted_chunks, check)
    written = sink.getvalue()
    with pytest.raises(KeyError):
        writer.write(_BODY[rejected_index - 1].kind, b"") if rejected_index < len(
            _BODY
        ) else writer.finish()

    assert sink.getvalue() == written
    for chunk in _BODY[rejected_index - 1 :]:
        writer.write(chunk.kind, chunk.payload)
    writer.finish()
    assert sink.getvalue() == _DATA


@pytest.mark.parametrize("max_chunk_bytes", [4 + 16 * 3, 4 + 16 * 3 - 1])
def test_an_index_beyond_the_limits_of_the_level_is_left_out(max_chunk_bytes, monkeypatch):
    monkeypatch.setitem(LEVELS, 10, Level(100, 100, max_chunk_bytes))
    sink = io.BytesIO()
    writer = StreamWriter(sink, wire.build_stream_header(StreamHeader()))
    for frame in range(3):
        writer.write(b"CANO", frame.to_bytes(4, "little"))
    writer.finish()

    *_, previous_chunk, last_chunk = split_chunks(sink.getvalue())
    tail = wire.parse_tail(last_chunk.payload)
    assert (tail.frame_count, tail.canonical_count) == (3, 3)
    if max_chunk_bytes < 4 + 16 * 3:
        assert (previous_chunk.kind, tail.index_offset) == (b"CANO", 0)
        return
    assert (previous_chunk.kind, tail.index_offset) == (b"INDX", previous_chunk.offset)
    canonical = [chunk for chunk in split_chunks(sink.getvalue()) if chunk.kind == b"CANO"]
    assert list(wire.parse_index(previous_chunk.payload)) == [
        SeekPoint(chunk.offset, chunk.sequence, frame) for frame, chunk in enumerate(canonical)
    ]
