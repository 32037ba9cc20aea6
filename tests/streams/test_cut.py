import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import StreamDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.errors import ChunkOrderError, EditError, FrameOrderError, TruncatedError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.cut import cut
from tests.small_streams import CountedSource, make_stream, rebuild_stream
from tests.streams.edits import cut_bytes, list_all_chunks, list_digests

_DATA, _ = make_stream(gaussian_count=12, frame_count=11, canonical_every=4)
_DIGESTS = list_digests(_DATA)
_FRAMES = {b"CANO", b"FRAM"}


def _add_unknown_chunks(data):
    """Return the stream with an unknown ancillary chunk after HEAD and after every frame."""
    chunks = []
    for chunk in split_chunks(data):
        if chunk.kind in {container.INDX, container.TAIL}:
            continue
        chunks.append((chunk.kind, chunk.payload))
        if chunk.kind in _FRAMES or chunk.kind == container.HEAD:
            chunks.append((b"nOte", str(len(chunks)).encode()))
    frames = sum(kind in _FRAMES for kind, _ in chunks)
    canonical = sum(kind == container.CANO for kind, _ in chunks)
    tail = wire.build_tail(wire.Tail(frames, canonical, 0))
    return rebuild_stream([*chunks, (container.TAIL, tail)])


@given(st.sampled_from([0, 4, 8]), st.integers(1, 12))
def test_a_cut_has_the_ordinals_and_digests_of_the_whole(start, length):
    data = cut_bytes(_DATA, start, start + length)

    assert list_digests(data) == _DIGESTS[start : start + length]


@given(st.sampled_from([0, 4, 8]), st.integers(1, 12))
def test_every_chunk_is_copied_unchanged(start, length):
    original_chunks = {
        (chunk.kind, chunk.payload) for chunk in list_all_chunks(_add_unknown_chunks(_DATA))
    }

    cut_chunks = list_all_chunks(cut_bytes(_add_unknown_chunks(_DATA), start, start + length))

    copied = [(chunk.kind, chunk.payload) for chunk in cut_chunks[:-2]]
    assert set(copied) <= original_chunks
    assert [chunk.kind for chunk in cut_chunks[-2:]] == [b"INDX", b"TAIL"]
    assert [kind for kind, _ in copied[:4]] == [b"HEAD", b"nOte", b"came", b"meta"]
    frames = min(start + length, 11) - start
    assert [kind for kind, _ in copied[5::2]] == [b"nOte"] * frames


def test_cutting_all_frames_gives_the_same_bytes():
    assert cut_bytes(_DATA) == _DATA
    assert cut_bytes(_DATA, 0, 99) == _DATA


def test_a_part_can_be_cut_again():
    first_cut = cut_bytes(_DATA, 4)

    assert cut_bytes(first_cut, None, 8) == cut_bytes(_DATA, 4, 8)


@pytest.mark.parametrize(
    ("start", "stop", "message"),
    [
        (6, None, "frame 6 is not a keyframe, .* keyframes are 4 and 8"),
        (10, None, "frame 10 is not a keyframe, .* keyframe is 8"),
        (11, None, "no frame 11; the nearest keyframe is 8"),
        (4, 4, "begins at frame 4 and ends before frame"),
    ],
)
def test_an_impossible_cut_names_the_nearest_keyframes(start, stop, message):
    sink = io.BytesIO()
    with pytest.raises(EditError, match=message):
        cut(CountedSource(_DATA), start, stop, sink)

    assert sink.getvalue() == b""


def test_frames_before_the_first_do_not_exist():
    later_frames = cut_bytes(_DATA, 4)

    with pytest.raises(EditError, match="no frame 2; the nearest keyframe is 4"):
        cut_bytes(later_frames, 2)
    with pytest.raises(EditError, match="begins at frame 4 and ends before frame"):
        cut_bytes(later_frames, None, 3)


def test_a_stream_without_frames_cannot_be_cut():
    chunks = list(split_chunks(_DATA))[:3]
    tail = (container.TAIL, wire.build_tail(wire.Tail(0, 0, 0)))
    data = rebuild_stream([*((chunk.kind, chunk.payload) for chunk in chunks), tail])

    with pytest.raises(EditError, match="the stream has no frames"):
        cut_bytes(data)


def test_the_cameras_and_metadata_in_effect_at_the_first_frame_are_kept():
    chunks = []
    for chunk in split_chunks(_DATA):
        if chunk.kind == container.CANO:
            chunk_index = len(chunks)
            chunks.append((b"meta", wire.build_metadata({"before": str(chunk_index)})))
        if chunk.kind not in {container.INDX, container.TAIL}:
            chunks.append((chunk.kind, chunk.payload))
    chunks.append((container.TAIL, wire.build_tail(wire.Tail(11, 3, 0))))
    data = rebuild_stream(chunks)

    decoder = StreamDecoder()
    for chunk in split_chunks(cut_bytes(data, 4, 8)):
        if chunk.kind == container.CANO:
            metadata_at_first_frame = dict(decoder.metadata)
        decoder.push(chunk)

    all_metadata = [wire.parse_metadata(payload) for kind, payload in chunks if kind == b"meta"]
    assert metadata_at_first_frame == all_metadata[2]
    assert decoder.metadata == metadata_at_first_frame  # not that of frame 8, which follows
    assert decoder.cameras


def test_data_after_the_frames_can_be_damaged():
    chunk = [chunk for chunk in split_chunks(_DATA) if chunk.kind in _FRAMES][6]
    damaged = bytearray(_DATA)
    damaged[chunk.offset + 30] ^= 1

    assert cut_bytes(bytes(damaged), 0, 6) == cut_bytes(_DATA, 0, 6)
    assert cut_bytes(bytes(damaged), 8) == cut_bytes(_DATA, 8)


def test_only_headers_of_skipped_frames_are_read():
    source = CountedSource(_DATA)
    cut(source, 8, None, io.BytesIO())
    skipped = [chunk for chunk in split_chunks(_DATA) if chunk.kind in _FRAMES][:8]

    for chunk in skipped:
        payload_range = range(chunk.offset + 24, chunk.offset + chunk.byte_count())
        assert not any(offset in payload_range for offset, _ in source.reads)
        assert not any(
            offset < payload_range[0] < offset + length for offset, length in source.reads
        )


@given(st.integers(0, len(_DATA) - 1))
def test_a_truncated_stream_cannot_be_cut_beyond_its_end(size):
    with pytest.raises(TruncatedError):
        cut_bytes(_DATA[:size])


def _build_stream_of_kinds(kinds):
    chunks = {chunk.kind: chunk.payload for chunk in split_chunks(_DATA)}
    return rebuild_stream([(kind, chunks[kind]) for kind in kinds])


def test_frames_out_of_order_are_rejected():
    with pytest.raises(FrameOrderError):
        cut_bytes(_build_stream_of_kinds([b"HEAD", b"CANO", b"CANO", b"TAIL"]))
    with pytest.raises(ChunkOrderError):
        cut_bytes(_build_stream_of_kinds([b"HEAD", b"FRAM", b"TAIL"]))


def test_a_snapshot_without_its_canonical_frame_is_rejected():
    header = StreamHeader(snapshots=True)
    data, _ = make_stream(header, gaussian_count=9, frame_count=2, snapshot_every=1)
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)]
    sink = io.BytesIO()

    stream = rebuild_stream([chunk for chunk in chunks if chunk[0] in {b"HEAD", b"SNAP"}])
    with pytest.raises(ChunkOrderError, match="a snapshot must follow a CANO"):
        cut(CountedSource(stream), None, None, sink)
    assert sink.getvalue() == b""
