import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder import compute_digest
from quarc_ref.format import container, wire
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, MAGIC
from quarc_ref.format.container import build_chunk
from quarc_ref.format.errors import (
    BitstreamError,
    IndexMismatchError,
    PayloadCrcError,
    TailMismatchError,
    TruncatedError,
)
from quarc_ref.format.records import SeekPoint, StreamHeader, Tail
from quarc_ref.streams import BytesSource, Follow, PipeSource, decode
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import CountedSource, make_stream, rebuild_stream

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=60, canonical_every=20)
_CHUNKS = list(split_chunks(_DATA))
_DIGESTS = [compute_digest(state.scene) for state in _STATES]
_CANONICAL = [chunk for chunk in _CHUNKS if chunk.kind == container.CANO]
_INDEX = wire.parse_index(_CHUNKS[-2].payload)
_TAIL_FIELDS = {"frame_count": 60, "canonical_count": 3, "index_offset": _CHUNKS[-2].offset}


def _without_index() -> bytes:
    tail = wire.build_tail(Tail(60, 3, 0))
    body = [(chunk.kind, chunk.payload) for chunk in _CHUNKS[:-2]]
    return rebuild_stream([*body, (container.TAIL, tail)])


def _replace_index_and_tail(index: list[SeekPoint], **changes: int) -> bytes:
    """Return the stream with another INDX and another TAIL."""
    body = [(chunk.kind, chunk.payload) for chunk in _CHUNKS[:-2]]
    tail = wire.build_tail(Tail(**(_TAIL_FIELDS | changes)))
    return rebuild_stream(
        [*body, (container.INDX, wire.build_index(index)), (container.TAIL, tail)]
    )


def _decode_truncated(data: bytes, start: int) -> list[int] | None:
    """Return the decoded frames of a truncated stream; None if no truncation is reported."""
    frames = []
    try:
        for scene in decode(data, start):
            frames.append(scene.frame)  # noqa: PERF401, keeps the frames before the error
    except TruncatedError:
        return frames
    return None


class _UnsizedSource(CountedSource):
    """A stream of unknown size."""

    def size(self):
        return None


_SOURCES = {
    "index": CountedSource(_DATA),
    "no index": CountedSource(_without_index()),
    "cut": CountedSource(_DATA[: _CHUNKS[-2].offset]),
    "endless": _UnsizedSource(_DATA),
}


def test_the_index_lists_every_canonical_frame():
    assert [point.frame for point in _INDEX] == [0, 20, 40]
    assert [point.offset for point in _INDEX] == [chunk.offset for chunk in _CANONICAL]
    assert [point.sequence for point in _INDEX] == [chunk.sequence for chunk in _CANONICAL]


@pytest.mark.parametrize("source_name", _SOURCES)
@given(st.data())
@settings(max_examples=10)
def test_every_range_decodes_as_in_the_whole_stream(source_name, data):
    start = data.draw(st.integers(0, 59))
    stop = data.draw(st.integers(start, 60))

    scenes = list(decode(_SOURCES[source_name], start, stop))

    assert [scene.frame for scene in scenes] == list(range(start, stop))
    assert [compute_digest(scene) for scene in scenes] == _DIGESTS[start:stop]


@pytest.mark.parametrize("data", [_DATA, _without_index()], ids=["index", "no index"])
def test_less_than_half_of_the_bytes_is_read_for_a_frame(data):
    source = CountedSource(data)

    (scene,) = decode(source, 40, 41)

    assert compute_digest(scene) == _DIGESTS[40]
    assert source.byte_count() < len(data) / 2


def test_with_an_index_only_the_needed_chunks_are_read():
    source = CountedSource(_DATA)
    list(decode(source, 23, 25))

    first = next(chunk.sequence for chunk in _CANONICAL if chunk.offset == _INDEX[1].offset)
    expected = {chunk.offset for chunk in _CHUNKS[first : first + 5]}
    expected |= {_CHUNKS[0].offset, _CHUNKS[-2].offset, _CHUNKS[-1].offset}
    read_chunks = {
        chunk.offset
        for chunk in _CHUNKS
        for offset, length in source.reads
        if length and chunk.offset <= offset < chunk.offset + chunk.byte_count()
    }
    assert read_chunks == expected


def test_without_an_index_only_headers_of_other_chunks_are_read():
    source = CountedSource(_without_index())
    list(decode(source, 41, 42))

    skipped = [chunk for chunk in _CHUNKS[1:] if chunk.offset < _CANONICAL[2].offset]
    for chunk in skipped:
        payload_reads = [
            length
            for offset, length in source.reads
            if chunk.offset + 20 <= offset < chunk.offset + chunk.byte_count()
        ]
        assert payload_reads == ([4] if chunk.kind == container.CANO else [])


def test_there_are_no_frames_after_the_last():
    assert list(decode(_DATA, 60)) == []
    assert list(decode(_without_index(), 70, 80)) == []


@pytest.mark.parametrize(
    "index",
    [
        [_INDEX[0], SeekPoint(_INDEX[1].offset, _INDEX[1].sequence, 21), _INDEX[2]],
        [_INDEX[0], SeekPoint(_INDEX[1].offset + 1, _INDEX[1].sequence, 20), _INDEX[2]],
        [_INDEX[0], SeekPoint(_INDEX[1].offset, _INDEX[1].sequence + 1, 20), _INDEX[2]],
        [_INDEX[0], SeekPoint(_CHUNKS[30].offset, 30, 20), _INDEX[2]],
        [_INDEX[0], SeekPoint(1 << 60, 30, 20), _INDEX[2]],
        [_INDEX[0], _INDEX[1]],
        [_INDEX[0], _INDEX[1], _INDEX[2], _INDEX[2]],
    ],
    ids=["frame", "offset", "sequence", "no canonical", "far away", "too few", "too many"],
)
def test_a_wrong_index_is_rejected_when_used_for_seeking_or_decoded(index):
    data = _replace_index_and_tail(index)

    with pytest.raises(IndexMismatchError):
        list(decode(data, 22, 23))
    with pytest.raises(IndexMismatchError):
        list(decode(data))


@pytest.mark.parametrize(
    "changes",
    [
        {"index_offset": 1},
        {"index_offset": _CHUNKS[-1].offset},
        {"index_offset": _CHUNKS[-3].offset},
        {"index_offset": 1 << 63},
        {"canonical_count": 2},
    ],
)
def test_a_tail_with_a_wrong_index_position_is_rejected_by_name(changes):
    data = _replace_index_and_tail(list(_INDEX), **changes)

    with pytest.raises(IndexMismatchError):
        list(decode(data, 22, 23))
    with pytest.raises(TailMismatchError):
        list(decode(data))


@pytest.mark.parametrize("start", [0, 1])
def test_a_million_missing_seek_points_are_rejected_at_once(start):
    count = (1 << 20) - 1  # the limit of level 2.0
    data, _ = make_stream(StreamHeader(level=20), gaussian_count=5, frame_count=2)
    *chunks, indx, _ = split_chunks(data)
    nearby_point = SeekPoint(chunks[-1].offset, 1, 0)
    index = count.to_bytes(4, "little") + wire.build_index([nearby_point])[4:] * count
    tail = wire.build_tail(Tail(2, count, indx.offset))
    body = [(chunk.kind, chunk.payload) for chunk in chunks]
    wrong_stream = rebuild_stream([*body, (container.INDX, index), (container.TAIL, tail)])

    start_time = time.monotonic()
    with pytest.raises(IndexMismatchError):
        list(decode(wrong_stream, start))
    assert time.monotonic() - start_time < 2


def test_an_index_that_does_not_end_at_the_tail_is_rejected():
    index = wire.build_index(_INDEX)
    body = MAGIC + b"".join(
        build_chunk(chunk.kind, chunk.sequence, chunk.payload) for chunk in _CHUNKS[:-2]
    )
    indx = build_chunk(container.INDX, _CHUNKS[-2].sequence, index)
    tail = build_chunk(
        container.TAIL, _CHUNKS[-1].sequence, wire.build_tail(Tail(60, 3, len(body)))
    )

    with pytest.raises(IndexMismatchError):
        list(decode(body + indx + bytes(3) + tail, 22, 23))


def test_the_message_about_a_wrong_seek_point_says_what_is_there():
    point = SeekPoint(_INDEX[1].offset, _INDEX[1].sequence, 21)
    data = _replace_index_and_tail([_INDEX[0], point, _INDEX[2]])
    place = f"in chunk {point.sequence} at byte {point.offset}"

    with pytest.raises(
        IndexMismatchError, match=f"lists frame 21 {place}, .* has frame 20 {place}"
    ):
        list(decode(data, 22, 23))


def test_decoding_from_a_seek_point_checks_the_tail():
    assert len(list(decode(_replace_index_and_tail(list(_INDEX)), 45))) == 15
    with pytest.raises(TailMismatchError, match=r"\(frames: 59, .* INDX at byte .* frames: 60,"):
        list(decode(_replace_index_and_tail(list(_INDEX), frame_count=59), 45))
    with pytest.raises(TailMismatchError):
        list(decode(_without_index()[:-40] + _tail(59, _CHUNKS[-2].sequence), 45))


def _tail(frames: int, sequence: int) -> bytes:
    return build_chunk(container.TAIL, sequence, wire.build_tail(Tail(frames, 3, 0)))


def test_crcs_of_all_read_chunks_are_checked():
    for chunk in (_CANONICAL[1], _CHUNKS[_CANONICAL[1].sequence + 1], _CHUNKS[-2]):
        damaged = bytearray(_DATA)
        damaged[chunk.offset + 30] ^= 1

        with pytest.raises(PayloadCrcError):
            list(decode(bytes(damaged), 22, 23))


@given(st.integers(0, len(_DATA) - 1), st.integers(0, 59))
@settings(max_examples=25)
def test_a_truncated_stream_gives_the_same_frames_when_seeking(size, start):
    all_frames = _decode_truncated(_DATA[:size], 0)

    assert _decode_truncated(_DATA[:size], start) == [
        frame for frame in all_frames if frame >= start
    ]


class _GrowingSource(BytesSource):
    """A stream of which more bytes arrive after a number of calls."""

    def __init__(self, data, first_bytes, call_count):
        super().__init__(data[:first_bytes])
        self._all_bytes, self._calls_left = data, call_count

    def read(self, offset, length):
        self._count_call()
        return super().read(offset, length)

    def size(self):
        self._count_call()
        return super().size()

    def _count_call(self):
        self._calls_left -= 1
        if self._calls_left < 0:
            self._data = self._all_bytes


def test_a_seek_waits_for_a_snapshot_of_which_a_part_has_arrived():
    data = (Path(__file__).parents[1] / "hostile/seeds/streams/snapshot.quarc").read_bytes()
    frames = [scene.frame for scene in decode(data)]
    snapshot = next(chunk for chunk in split_chunks(data) if chunk.kind == container.SNAP)
    for payload_bytes in range(10):
        source = _GrowingSource(
            data, snapshot.offset + CHUNK_HEADER_BYTES + payload_bytes, call_count=40
        )
        scenes = list(decode(source, frames[-1], follow=Follow(interval=0.001)))
        assert [scene.frame for scene in scenes] == frames[-1:]


def test_a_canonical_frame_truncated_in_its_ordinal_is_not_a_seek_point():
    size = _CANONICAL[1].offset + 20 + 2

    assert _decode_truncated(_DATA[:size], 15) == [15, 16, 17, 18, 19]
    assert _decode_truncated(_DATA[:size], 25) == []


@given(st.integers(0, len(_DATA) - 1), st.integers(1, 255))
@settings(max_examples=25)
def test_damage_never_gives_another_scene(offset, mask):
    damaged = bytearray(_DATA)
    damaged[offset] ^= mask
    try:
        for scene in decode(bytes(damaged), 25, 45):
            assert compute_digest(scene) == _DIGESTS[scene.frame]
    except BitstreamError:
        return


def test_seeking_works_in_a_stream_that_begins_with_a_later_ordinal():
    later_chunks = _CHUNKS[_CANONICAL[1].sequence : -2]
    data = rebuild_stream([(c.kind, c.payload) for c in (_CHUNKS[0], *later_chunks)])

    for start in (5, 20, 41):
        assert _decode_truncated(data, start) == list(range(max(20, start), 60))


def test_another_chunk_as_long_as_a_tail_is_not_a_tail():
    body = [(chunk.kind, chunk.payload) for chunk in _CHUNKS[:-2]]
    data = rebuild_stream([*body, (b"oDds", bytes(16))])

    assert _decode_truncated(data, 57) == [57, 58, 59]


def test_a_pipe_can_only_be_read_forward(tmp_path):
    (tmp_path / "stream").write_bytes(_DATA)
    with (tmp_path / "stream").open("rb") as file:
        scenes = list(decode(PipeSource(file, buffer_bytes=0), 41, 43))

    assert [compute_digest(scene) for scene in scenes] == _DIGESTS[41:43]
