import io
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder import StreamDecoder, compute_digest
from quarc_ref.format import container, wire
from quarc_ref.format.constants import COUNTER_LIMIT
from quarc_ref.format.errors import (
    BadMagicError,
    ChunkOrderError,
    EditError,
    PayloadCrcError,
    TruncatedError,
)
from quarc_ref.format.records import StreamHeader, Tail
from quarc_ref.streams import decode
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.join import join
from quarc_ref.streams.source import BytesSource
from tests.small_streams import CAMERA, make_stream, rebuild_stream
from tests.streams.edits import cut_bytes, join_bytes, list_all_chunks, list_digests

_HEADER = StreamHeader(seed=7, gaussians_per_anchor=4)
_DATA, _ = make_stream(_HEADER, gaussian_count=12, frame_count=11, canonical_every=4)
_SHORT, _ = make_stream(_HEADER, gaussian_count=9, frame_count=3)
_DIGESTS, _SHORT_DIGESTS = list_digests(_DATA), list_digests(_SHORT)


def _replace_payloads(data, changes):
    """Return the stream with other payloads by chunk type; None omits the chunk."""
    chunks = [(chunk.kind, changes.get(chunk.kind, chunk.payload)) for chunk in split_chunks(data)]
    chunks = [(kind, payload) for kind, payload in chunks if payload is not None]
    tail = wire.parse_tail(chunks[-1][1])
    chunks = [*chunks[:-2], (b"TAIL", wire.build_tail(replace(tail, index_offset=0)))]
    return rebuild_stream(chunks)


def _read(data):
    decoder = StreamDecoder()
    for chunk in split_chunks(data):
        decoder.push(chunk)
    return decoder


def test_the_joined_parts_of_a_stream_are_the_stream():
    parts = [cut_bytes(_DATA, 0, 4), cut_bytes(_DATA, 4, 8), cut_bytes(_DATA, 8)]

    assert join_bytes(*parts) == _DATA
    assert join_bytes(_DATA) == _DATA


def test_the_joined_parts_of_a_stream_are_of_the_same_capture():
    metadata = {"start": "30", "fingerprint": "f"}
    data = _replace_payloads(_DATA, {container.META: wire.build_metadata(metadata)})
    parts = [cut_bytes(data, *frames) for frames in ((0, 4), (4, 8), (8, None))]

    assert _read(join_bytes(*parts)).metadata == metadata
    assert _read(join_bytes(*parts[1:])).metadata == metadata
    assert _read(join_bytes(parts[0], parts[2])).metadata == {}


@given(st.lists(st.sampled_from([(0, 2), (4, 7), (8, 11), (0, 11)]), min_size=1, max_size=4))
@settings(max_examples=15)
def test_any_parts_in_any_order_decode_to_the_digests_of_the_parts(ranges):
    data = join_bytes(*(cut_bytes(_DATA, *frame_range) for frame_range in ranges))

    digests = [digest for start, stop in ranges for _, digest in _DIGESTS[start:stop]]
    first = ranges[0][0]
    assert list_digests(data) == list(enumerate(digests, first))
    decoder = _read(data)
    assert decoder.tail.frame_count == len(digests)
    canonical = {_DIGESTS[frame_index][1] for frame_index in (0, 4, 8)}
    assert [point.frame for point in decoder.index] == [
        frame for frame, digest in enumerate(digests, first) if digest in canonical
    ]


def test_only_the_ordinals_of_canonical_frames_change():
    original_chunks = list(split_chunks(_DATA)) + list(split_chunks(_SHORT))
    kinds = {container.CANO, container.FRAM}
    original_chunks = [chunk for chunk in original_chunks if chunk.kind in kinds]

    joined_chunks = [
        chunk for chunk in split_chunks(join_bytes(_DATA, _SHORT)) if chunk.kind in kinds
    ]

    changed = [
        (original.payload[:4], joined.payload[:4])
        for original, joined in zip(original_chunks, joined_chunks, strict=True)
        if original.payload != joined.payload
    ]
    assert changed == [(bytes(4), (11).to_bytes(4, "little"))]
    assert all(
        a.payload[4:] == b.payload[4:] for a, b in zip(original_chunks, joined_chunks, strict=True)
    )


def test_every_frame_of_a_joined_stream_can_be_found_by_seeking():
    data = join_bytes(_SHORT, _DATA)
    digests = [digest for _, digest in (*_SHORT_DIGESTS, *_DIGESTS)]

    for frame, digest in enumerate(digests):
        (scene,) = decode(data, frame, frame + 1)
        assert (scene.frame, compute_digest(scene)) == (frame, digest)


def test_the_highest_level_is_used():
    header = wire.build_stream_header(replace(_HEADER, level=20))

    joined = join_bytes(_SHORT, _replace_payloads(_SHORT, {b"HEAD": header}), _SHORT)

    assert _read(joined).header == replace(_HEADER, level=20)


def test_headers_that_differ_are_named_field_by_field():
    other_stream, _ = make_stream(replace(_HEADER, position_step=5, timescale=25), frame_count=2)

    with pytest.raises(EditError, match=r"stream 2 differs .*timescale .30 and 25.*position_step"):
        join_bytes(_SHORT, other_stream)


def test_a_feature_that_differs_is_named_only_once():
    updates, snapshots = (
        make_stream(replace(_HEADER, **{feature: True}), frame_count=2)[0]
        for feature in ("updates", "snapshots")
    )

    message = r"in updates \(True and False\), snapshots \(False and True\)$"
    with pytest.raises(EditError, match=message):
        join_bytes(updates, snapshots)


def test_unknown_features_must_be_the_same():
    head = bytearray(wire.build_stream_header(_HEADER))
    head[6] = 1
    other_stream = _replace_payloads(_SHORT, {b"HEAD": bytes(head)})

    message = r"stream 3 differs from the first in compatible_features \(0 and 1\)"
    with pytest.raises(EditError, match=message):
        join_bytes(_SHORT, _SHORT, other_stream)
    assert list_all_chunks(join_bytes(other_stream, other_stream))[0].payload == head


@pytest.mark.parametrize("cameras", [(), (replace(CAMERA, fx=51.0),), (CAMERA, CAMERA)])
def test_cameras_must_be_the_same(cameras):
    other_stream = _replace_payloads(_SHORT, {b"came": wire.build_cameras(cameras)})

    with pytest.raises(EditError, match="different cameras"):
        join_bytes(_SHORT, other_stream)


def _insert_chunk(index, kind, payload):
    """Return the stream _SHORT with a chunk before its chunk `index`."""
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(_SHORT)]
    tail = (b"TAIL", wire.build_tail(Tail(3, 1, 0)))
    return rebuild_stream([*chunks[:index], (kind, payload), *chunks[index:-2], tail])


@pytest.mark.parametrize(("index", "frame"), [(4, 0), (5, 1), (6, 2)])
@pytest.mark.parametrize(
    ("kind", "payload", "content"),
    [
        (b"came", wire.build_cameras((replace(CAMERA, fx=51.0),)), "cameras"),
        (b"meta", wire.build_metadata({"other": "text"}), "metadata"),
    ],
    ids=["cameras", "metadata"],
)
def test_cameras_and_metadata_must_not_change_after_the_first_frame(
    index, frame, kind, payload, content
):
    stream = _insert_chunk(index, kind, payload)

    message = f"stream 2 has other {content} after frame {frame} than before"
    with pytest.raises(EditError, match=message):
        join_bytes(_SHORT, stream)
    with pytest.raises(EditError, match="stream 1 has other"):
        join_bytes(stream)


def test_cameras_may_be_replaced_before_the_first_frame_and_repeated_later():
    other_cameras = wire.build_cameras((replace(CAMERA, fx=51.0),))
    cameras = wire.build_cameras((CAMERA,))

    replaced = join_bytes(_insert_chunk(3, b"came", other_cameras))
    repeated = join_bytes(_insert_chunk(5, b"came", cameras))

    assert _read(replaced).cameras == (replace(CAMERA, fx=51.0),)
    assert repeated == _SHORT


def test_metadata_shared_by_all_parts_is_kept():
    metadata = [
        {"a": "1", "b": "2", "c": "3"},
        {"c": "3", "b": "0", "a": "1"},
        {"a": "1", "c": "3"},
    ]
    parts = [_replace_payloads(_SHORT, {b"meta": wire.build_metadata(each)}) for each in metadata]

    assert _read(join_bytes(*parts)).metadata == {"a": "1", "c": "3"}
    assert _read(join_bytes(*parts, _replace_payloads(_SHORT, {b"meta": None}))).metadata == {}


def test_the_first_frame_in_the_capture_is_that_of_the_first_stream():
    payloads = [wire.build_metadata({"start": start}) for start in ("30", "33")]
    parts = [_replace_payloads(_SHORT, {b"meta": payload}) for payload in payloads]

    assert _read(join_bytes(*parts)).metadata == {"start": "30"}


@pytest.mark.parametrize(("starts", "is_kept"), [((30, 33), True), ((30, 34), False)])
def test_the_fingerprint_is_kept_only_if_the_frames_are_consecutive(starts, is_kept):
    metadata = [{"fingerprint": "f", "start": str(start)} for start in starts]
    parts = [_replace_payloads(_SHORT, {b"meta": wire.build_metadata(each)}) for each in metadata]

    assert _read(join_bytes(*parts)).metadata == (metadata[0] if is_kept else {})


def test_streams_without_cameras_and_metadata_join_without_them():
    stream = _replace_payloads(_SHORT, {b"meta": None, b"came": None})

    kinds = [chunk.kind for chunk in list_all_chunks(join_bytes(stream, stream))]
    assert kinds == [b"HEAD", *[b"CANO", b"FRAM", b"FRAM"] * 2, b"INDX", b"TAIL"]


def test_unknown_ancillary_chunks_are_copied_and_common_first_chunks_only_once():
    def add_notes(first, last):
        chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(_SHORT)][:-2]
        tail = (b"TAIL", wire.build_tail(wire.Tail(3, 1, 0)))
        return rebuild_stream([chunks[0], (b"note", first), *chunks[1:], (b"note", last), tail])

    joined = join_bytes(
        add_notes(b"same", b"x"), add_notes(b"same", b"x"), add_notes(b"other", b"y")
    )

    notes = [chunk.payload for chunk in list_all_chunks(joined) if chunk.kind == b"note"]
    assert notes == [b"same", b"x", b"x", b"other", b"y"]


def test_ordinals_beyond_their_field_are_rejected():
    chunks_of_short = list(split_chunks(_SHORT))
    cano = (COUNTER_LIMIT - 1).to_bytes(4, "little") + chunks_of_short[3].payload[4:]
    tail = wire.build_tail(wire.Tail(1, 1, 0))
    chunks = [(chunk.kind, chunk.payload) for chunk in chunks_of_short[:3]]
    last_frame_stream = rebuild_stream([*chunks, (b"CANO", cano), (b"TAIL", tail)])

    assert [frame for frame, _ in list_digests(join_bytes(last_frame_stream))] == [
        COUNTER_LIMIT - 1
    ]
    assert list_digests(join_bytes(last_frame_stream, last_frame_stream))[-1][0] == COUNTER_LIMIT
    with pytest.raises(EditError, match="frame numbers are limited to"):
        join_bytes(last_frame_stream, last_frame_stream, last_frame_stream)


def test_joining_no_streams_is_rejected():
    with pytest.raises(EditError, match="no streams to join"):
        join_bytes()


@given(st.integers(0, len(_SHORT) - 1))
def test_a_truncated_part_is_rejected(size):
    with pytest.raises(TruncatedError, match="stream 2: the stream ends ") as caught:
        join_bytes(_DATA, _SHORT[:size])
    assert caught.value.offset <= size


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_file_that_is_not_a_stream_is_named(number):
    parts = [_SHORT, _SHORT]
    parts.insert(number - 1, b"this is text")

    with pytest.raises(BadMagicError, match=f"^bad-magic at byte 0: stream {number}: not a"):
        join_bytes(*parts)


def test_a_fault_in_copied_data_is_named():
    offset = list_all_chunks(_SHORT)[3].offset + 40  # in the payload of the canonical frame
    damaged = _SHORT[:offset] + bytes([_SHORT[offset] ^ 1]) + _SHORT[offset + 1 :]

    with pytest.raises(PayloadCrcError, match="stream 2: "):
        join_bytes(_SHORT, damaged)


def test_a_part_that_begins_with_a_snapshot_is_named():
    header = replace(_HEADER, snapshots=True)
    data, _ = make_stream(header, gaussian_count=9, frame_count=3, snapshot_every=1)
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)]
    tail = (b"TAIL", wire.build_tail(Tail(2, 2, 0)))
    snapshots = [chunk for chunk in chunks if chunk[0] in {b"HEAD", b"came", b"SNAP"}]

    with pytest.raises(ChunkOrderError, match="stream 2: a snapshot must follow a CANO"):
        join_bytes(data, rebuild_stream([*snapshots, tail]))


class _UnsizedSource(BytesSource):
    """A source of unknown size, so that frames are not counted from TAIL."""

    def size(self):
        return None


def test_streams_without_a_frame_count_can_be_joined():
    sink = io.BytesIO()
    join([_UnsizedSource(_DATA), _UnsizedSource(_SHORT)], sink)

    assert sink.getvalue() == join_bytes(_DATA, _SHORT)
