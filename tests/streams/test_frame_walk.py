import pytest

from quarc_ref.format.errors import TruncatedError
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.frame_walk import FrameWalk
from quarc_ref.streams.source import BytesSource
from tests.small_streams import make_stream

_DATA, _ = make_stream(frame_count=3)
_CHUNKS = list(split_chunks(_DATA))


class _SizeCountingSource(BytesSource):
    """A stream that counts requests for its size, and can grow."""

    def __init__(self, data, *, grows_by=0):
        super().__init__(data)
        self.size_requests, self._grows_by = 0, grows_by

    def size(self):
        self.size_requests += 1
        size = super().size()
        return size - self._grows_by if self.size_requests == 1 else size


@pytest.mark.parametrize("index", range(1, len(_CHUNKS)))
def test_a_skipped_chunk_must_end_within_the_stream(index):
    chunk = _CHUNKS[index]
    end = _CHUNKS[index + 1].offset if index + 1 < len(_CHUNKS) else len(_DATA)

    with pytest.raises(TruncatedError, match="ends inside a chunk") as caught:
        list(FrameWalk(BytesSource(_DATA[: end - 1])))
    assert caught.value.offset == chunk.offset


def test_the_size_is_requested_once():
    source = _SizeCountingSource(_DATA)

    assert len(list(FrameWalk(source))) == len(_CHUNKS) - 3
    assert source.size_requests == 1


def test_appended_bytes_are_found():
    source = _SizeCountingSource(_DATA, grows_by=len(_DATA) - _CHUNKS[-3].offset)

    assert len(list(FrameWalk(source))) == len(_CHUNKS) - 3
    assert source.size_requests == 2
