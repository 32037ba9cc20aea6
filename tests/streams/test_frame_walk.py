import pytest

from quarc_ref.format.constants import CHUNK_HEADER_BYTES
from quarc_ref.format.errors import (
    ChunkOrderError,
    FieldError,
    FrameOrderError,
    TruncatedError,
)
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.frame_walk import FrameWalk
from quarc_ref.streams.source import BytesSource
from tests.small_streams import make_stream, rebuild_stream

_DATA, _ = make_stream(frame_count=3)
_CHUNKS = list(split_chunks(_DATA))
_SNAPSHOT_DATA, _ = make_stream(
    StreamHeader(snapshots=True), gaussian_count=9, frame_count=2, snapshot_every=1
)
_PAYLOADS = {chunk.kind: chunk.payload for chunk in split_chunks(_SNAPSHOT_DATA)}


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


def _walk(**payloads):
    """Walk over a stream with snapshots; an empty payload stands for the original one."""
    chunks = [(kind.encode(), payload) for kind, payload in {"HEAD": b"", **payloads}.items()]
    data = rebuild_stream([(kind, payload or _PAYLOADS[kind]) for kind, payload in chunks])
    return list(FrameWalk(BytesSource(data)))


def test_a_snapshot_must_follow_the_canonical_frame_that_it_refers_to():
    other_reference = _PAYLOADS[b"SNAP"][:4] + b"\7\0\0\0" + _PAYLOADS[b"SNAP"][8:]

    steps = list(FrameWalk(BytesSource(_SNAPSHOT_DATA)))
    assert [step.frame for step in steps if step.is_canonical] == [0, 1]
    with pytest.raises(ChunkOrderError, match="a snapshot must follow a CANO"):
        _walk(SNAP=b"")
    with pytest.raises(FrameOrderError, match=r"frame 1 is coded against frame 7, .* is frame 0"):
        _walk(CANO=b"", SNAP=other_reference)


@pytest.mark.parametrize("length", [1, 3, 4, 7])
def test_a_payload_that_is_too_short_for_its_ordinals_is_rejected(length):
    with pytest.raises(FieldError, match=f"a payload of {length} bytes is too short"):
        _walk(CANO=b"", SNAP=_PAYLOADS[b"SNAP"][:length])
    if length < 4:
        with pytest.raises(FieldError, match=f"a payload of {length} bytes is too short"):
            _walk(CANO=_PAYLOADS[b"CANO"][:length])


def test_a_snapshot_truncated_in_its_ordinals_is_truncated():
    snapshot = next(chunk for chunk in split_chunks(_SNAPSHOT_DATA) if chunk.kind == b"SNAP")

    for byte_count in range(8):
        size = snapshot.offset + CHUNK_HEADER_BYTES + byte_count
        with pytest.raises(TruncatedError, match="ends inside a chunk"):
            list(FrameWalk(BytesSource(_SNAPSHOT_DATA[:size])))
