import io

import pytest

from quarc_ref.format import container
from quarc_ref.format.errors import BitstreamError, TrailingDataError, TruncatedError
from quarc_ref.streams import BytesSource, PipeSource
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.copy_stream import copy_stream
from tests.small_streams import CountedSource, make_stream, rebuild_stream


@pytest.fixture(scope="module")
def data():
    return make_stream(frame_count=5, canonical_every=3)[0]


def _copy(source):
    sink = io.BytesIO()
    return copy_stream(source, sink), sink.getvalue()


def test_a_copy_equals_the_stream_and_its_frames_are_counted(data):
    assert _copy(BytesSource(data)) == (5, data)


def test_a_stream_from_a_pipe_can_be_copied(data):
    assert _copy(PipeSource(io.BytesIO(data), buffer_bytes=1 << 16)) == (5, data)


def test_chunks_of_unknown_types_are_copied(data):
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)]
    chunks = [(kind, payload) for kind, payload in chunks if kind != container.INDX]
    chunks.insert(2, (b"note", b"of somebody else"))
    stream = rebuild_stream(chunks)

    assert _copy(BytesSource(stream))[1] == stream


class _ChangingSource(CountedSource):
    """A stream whose bytes are changed once they have been read."""

    def read(self, offset, length):
        data = super().read(offset, length)
        changed = bytearray(self._data)
        changed[offset : offset + len(data)] = bytes(len(data))
        self._data = memoryview(changed)
        return data


def test_what_was_checked_is_written_without_a_second_read(data):
    source = _ChangingSource(data)

    assert _copy(source) == (5, data)
    assert source.byte_count() == len(data)


def test_every_byte_of_a_chunk_is_checked(data):
    for offset in range(0, len(data), 7):
        damaged = data[:offset] + bytes([data[offset] ^ 4]) + data[offset + 1 :]
        with pytest.raises(BitstreamError):
            _copy(BytesSource(damaged))


def test_a_missing_or_premature_end_is_rejected(data):
    with pytest.raises(TruncatedError):
        _copy(BytesSource(data[:-1]))
    with pytest.raises(TrailingDataError):
        _copy(BytesSource(data + b"\0"))
