import zlib
from contextlib import suppress

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.constants import MAGIC
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import (
    BitstreamError,
    ChunkOrderError,
    ChunkSizeError,
    CountError,
    CountLevelError,
    FieldError,
    FrameOrderError,
    IndexMismatchError,
    LimitError,
    StateCrcError,
    TailMismatchError,
    TrailingDataError,
    TruncatedError,
)
from quarc_ref.format.records import SeekPoint, StreamHeader, Tail
from quarc_ref.streams import decode, recover
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import CAMERA, make_stream, rebuild_stream

_DATA, _STATES = make_stream()
_SMALL, _ = make_stream(gaussian_count=5, frame_count=3, canonical_every=2)


def _change_chunks(change):
    """Return the stream with payloads changed by a function of (kind, payload)."""
    return rebuild_stream(
        (chunk.kind, change(chunk.kind, chunk.payload)) for chunk in split_chunks(_DATA)
    )


def _find_chunk(kind):
    """Return the first chunk of a type in the stream."""
    return next(chunk for chunk in split_chunks(_DATA) if chunk.kind == kind)


def _decode_until_error(data):
    """Return the ordinals of the decoded frames of a stream, and the error at its end."""
    frames = []
    try:
        for scene in decode(data):
            frames.append(scene.frame)  # noqa: PERF401, keeps the frames before the error
    except BitstreamError as error:
        return frames, error
    return frames, None


@pytest.mark.parametrize(
    ("kind", "offset", "value"),
    [
        (container.CANO, 4, 0xFFFFFFFF),
        (container.CANO, 4, (1 << 20) + 1),
        (container.FRAM, 9, (1 << 16) + 1),
        (container.FRAM, 9, 0xFFFFFFFF),
    ],
)
def test_a_frame_beyond_the_decoders_limits_is_declined_and_not_rejected(kind, offset, value):
    def change(chunk_kind, payload):
        if chunk_kind == container.HEAD:
            return payload[:10] + bytes([31]) + payload[11:]
        return _put_number(payload, offset, value) if chunk_kind == kind else payload

    with pytest.raises(LimitError, match=r"(Gaussians|births) .* this decoder"):
        list(decode(_change_chunks(change)))


@pytest.mark.parametrize("read", [decode, recover])
@pytest.mark.parametrize(("byte_count", "error"), [(1 << 26, None), ((1 << 26) + 1, LimitError)])
def test_a_payload_beyond_the_decoders_limit_is_declined_before_it_is_read(read, byte_count, error):
    head = bytearray(_find_chunk(container.HEAD).payload)
    head[10] = 31
    fields = wire.build_chunk_header(container.CANO, 1, byte_count, 0)[:-4]
    data = MAGIC + container.build_chunk(container.HEAD, 0, bytes(head))
    data += fields + zlib.crc32(fields).to_bytes(4, "little")

    with pytest.raises(error) if error else suppress(TruncatedError):
        list(read(data))


def _put_number(payload, offset, value):
    return payload[:offset] + value.to_bytes(4, "little") + payload[offset + 4 :]


def test_a_decoder_has_the_states_of_the_writer():
    digests = [compute_digest(scene) for scene in decode(_DATA)]

    assert digests == [compute_digest(state.scene) for state in _STATES]
    assert len(set(digests)) == len(_STATES)


def test_decoding_twice_gives_the_same():
    assert [compute_digest(s) for s in decode(_DATA)] == [compute_digest(s) for s in decode(_DATA)]


@pytest.mark.parametrize(
    ("start", "stop", "frames"), [(0, 2, [0, 1]), (2, None, [2, 3]), (9, 10, [])]
)
def test_a_range_of_frames_is_decoded_alone(start, stop, frames):
    assert [scene.frame for scene in decode(_DATA, start, stop)] == frames


def test_a_flipped_byte_anywhere_is_rejected_by_name():
    undetected = []
    for offset in range(len(_SMALL)):
        damaged = bytearray(_SMALL)
        damaged[offset] ^= 1 << (offset % 8)
        _, error = _decode_until_error(bytes(damaged))
        if error is None or not error.reject_id:
            undetected.append(offset)

    assert undetected == []


def test_a_truncated_stream_gives_its_complete_frames_and_an_error():
    ends = [
        chunk.offset + chunk.byte_count()
        for chunk in split_chunks(_SMALL)
        if chunk.kind in (container.CANO, container.FRAM)
    ]

    for size in range(len(_SMALL)):
        frames, error = _decode_until_error(_SMALL[:size])

        assert frames == list(range(sum(end <= size for end in ends)))
        assert isinstance(error, TruncatedError)


def test_cameras_and_metadata_are_read():
    decoder = StreamDecoder()
    for chunk in split_chunks(_DATA):
        decoder.push(chunk)

    assert decoder.cameras == (CAMERA,)
    assert decoder.metadata == {"capture": "made by hand"}
    index, first = _find_chunk(container.INDX), _find_chunk(container.CANO)
    assert decoder.tail == Tail(4, 1, index.offset)
    assert list(decoder.index) == [SeekPoint(first.offset, first.sequence, 0)]


def test_a_wrong_state_crc_is_rejected_after_the_earlier_frames():
    def change(kind, payload):
        return payload[:-4] + b"\0\0\0\0" if kind == container.FRAM else payload

    frames, error = _decode_until_error(_change_chunks(change))

    assert frames == [0]
    assert isinstance(error, StateCrcError)


@pytest.mark.parametrize(
    ("kind", "offset", "value", "error"),
    [
        (container.CANO, 4, 0, CountError),
        (container.CANO, 4, (1 << 16) + 1, CountLevelError),
        (container.FRAM, 0, 7, FrameOrderError),
        (container.FRAM, 5, 40, CountError),
        (container.FRAM, 9, (1 << 12) + 1, CountLevelError),
        (container.TAIL, 0, 3, TailMismatchError),
        (container.TAIL, 4, 2, TailMismatchError),
        (container.TAIL, 8, 0, TailMismatchError),
        (container.TAIL, 12, 1, TailMismatchError),
        (container.INDX, 0, 0, TrailingDataError),
        (container.INDX, 0, 2, FieldError),
        (container.INDX, 4, 9, IndexMismatchError),
        (container.INDX, 8, 1, IndexMismatchError),
        (container.INDX, 12, 4, IndexMismatchError),
        (container.INDX, 16, 1, IndexMismatchError),
    ],
)
def test_counts_are_checked_before_use(kind, offset, value, error):
    def change(chunk_kind, payload):
        number = value.to_bytes(4, "little")
        return payload[:offset] + number + payload[offset + 4 :] if chunk_kind == kind else payload

    assert isinstance(_decode_until_error(_change_chunks(change))[1], error)


def test_a_frame_before_any_canonical_frame_is_rejected():
    decoder = StreamDecoder()
    decoder.push(Chunk(container.HEAD, wire.build_stream_header(StreamHeader()), 8, 0))

    with pytest.raises(ChunkOrderError):
        decoder.push(_find_chunk(container.FRAM))


def test_a_chunk_before_the_header_is_rejected():
    with pytest.raises(ChunkOrderError):
        StreamDecoder().push(Chunk(container.META, wire.build_metadata({}), 8, 1))


def test_a_canonical_frame_can_be_repeated():
    chunks = list(split_chunks(_DATA))
    decoder = StreamDecoder()
    for chunk in chunks[:-1]:
        decoder.push(chunk)
    payload = bytearray(_find_chunk(container.CANO).payload)
    payload[:4] = (4).to_bytes(4, "little")

    state = decoder.push(Chunk(container.CANO, bytes(payload), 0, 8))

    assert state is not None
    assert state.scene.frame == 4
    assert state.scene.phase == 0
    assert compute_digest(state.scene) == compute_digest(_STATES[0].scene)
    with pytest.raises(FrameOrderError):
        decoder.push(Chunk(container.CANO, bytes(payload), 0, 8))


def test_no_frame_follows_the_last_ordinal():
    def change(kind, payload):
        return b"\xff\xff\xff\xff" + payload[4:] if kind == container.CANO else payload

    frames, error = _decode_until_error(_change_chunks(change))

    assert frames == [(1 << 32) - 1]
    assert isinstance(error, FrameOrderError)


def test_a_pushed_unknown_chunk_changes_nothing():
    decoder = StreamDecoder()
    decoder.push(Chunk(container.HEAD, wire.build_stream_header(StreamHeader()), 8, 0))

    assert decoder.push(Chunk(b"oDds", b"whatever", 0, 1)) is None


def test_without_seeking_nothing_is_skipped():
    decoder = StreamDecoder()
    decoder.skip_to(())
    for chunk in split_chunks(_DATA):
        decoder.push(chunk)

    assert decoder.tail is not None


def test_a_payload_beyond_the_level_is_rejected():
    decoder = StreamDecoder()
    decoder.push(Chunk(container.HEAD, wire.build_stream_header(StreamHeader()), 8, 0))

    with pytest.raises(ChunkSizeError):
        decoder.push(Chunk(container.META, bytes((1 << 22) + 1), 8, 1))


def test_a_rejected_frame_does_not_change_the_decoder():
    chunks = list(split_chunks(_DATA))
    decoder = StreamDecoder()
    for chunk in chunks[:4]:
        decoder.push(chunk)
    rejected_chunk = Chunk(container.FRAM, chunks[4].payload[:-1] + b"\0", 0, 4)
    with pytest.raises(BitstreamError):
        decoder.push(rejected_chunk)

    state = decoder.push(chunks[4])

    assert state is not None
    assert compute_digest(state.scene) == compute_digest(_STATES[1].scene)


@pytest.mark.parametrize(
    "changes", [{"sh_degree": 0}, {"rotation_components": 4}, {"level_count": 1}]
)
def test_streams_with_other_headers_survive_a_round_trip(changes):
    data, states = make_stream(StreamHeader(seed=3, **changes))

    assert [compute_digest(s) for s in decode(data)] == [compute_digest(s.scene) for s in states]


def test_the_codes_are_included_at_every_full_crc_interval():
    header = StreamHeader(full_crc_interval=2)
    data, _ = make_stream(header, frame_count=5)
    decoder = StreamDecoder()
    for chunk in split_chunks(data):
        state = decoder.push(chunk)
        if state is None or state.scene.phase == 0:
            continue
        crc = int.from_bytes(chunk.payload[-4:], "little")
        planes = [state.scene.positions, state.scene.rotations]
        if state.scene.phase % 2 == 0:
            planes.append(state.scene.codes)
        arrays = [np.array([state.scene.count, state.scene.phase]), state.scene.ids, *planes]
        serialized = b"".join(array.astype("<i4").tobytes() for array in arrays)
        assert crc == container.zlib.crc32(serialized)
