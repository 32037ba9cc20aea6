"""Random access: requests for frames that do not exist, and faults (SPEC 11.2)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import CANO_CHUNK_INDEX, INDX_CHUNK_INDEX, TAIL_CHUNK_INDEX
from making.payloads import Head, pack_metadata, pack_tail
from making.scenes import make_cloud
from making.streams import Chunk, Stream, assemble
from making.vectors import (
    Outcome,
    ValidStream,
    Vector,
    make_patched_vector,
    make_valid_stream,
)

_REQUESTED_FRAME = 7
"""The frame to seek to; decoding starts at the seek point of frame 6."""


def make_outside_seek_streams() -> list[ValidStream]:
    """Return streams in which decoders seek to frames before the first or after the last one."""
    late_stream = Stream(Head()).add_canonical(7, make_cloud(4)).add_frame().finish(index=True)
    frames = late_stream.list_decoded_frames()
    late_seek = ((0, frames), (7, frames), (8, frames[1:]), (9, []), (4294967295, []))
    empty_stream = Stream(Head()).add_chunk(b"note", b"").finish(index=True)
    return [
        make_valid_stream(
            "streams/seek-outside",
            "seeking to frames before the first one and after the last one",
            "11.2-1",
            late_stream,
            seek=tuple((frame, Outcome(expected)) for frame, expected in late_seek),
        ),
        make_valid_stream(
            "streams/seek-no-frames",
            "seeking in a stream without frames, whose INDX has no seek points",
            "11.2-1 11.2-3",
            empty_stream,
            seek=tuple((frame, Outcome(())) for frame in (0, 1)),
        ),
    ]


def make_seek_faults(parent: ValidStream, late_start: ValidStream) -> list[Vector]:
    """Return all vectors with faults.

    Args:
        parent: `streams/journey`.
        late_start: `streams/canonical-after-canonical`, whose first frame has ordinal 7.
    """
    return [
        *_make_offset_faults(parent),
        *_make_index_faults(parent),
        *_make_skipped_faults(parent),
        *_make_streams_without_index(parent),
        _make_byte_after_tail(late_start),
        *_make_skipped_ordinals(parent),
    ]


def _make_byte_after_tail(late_start: ValidStream) -> Vector:
    """Return a stream whose last 40 bytes are not a TAIL, so that seeking reads headers."""
    frames, reject_ids = late_start.frames, ("trailing-data",)
    vector = make_patched_vector(
        late_start,
        "invalid/seek-before-the-first",
        "5.1-5 11.2-1",
        late_start.layout.data + b"\0",
        Outcome(frames, reject_ids),
        "a byte follows TAIL; seeking to a frame before the first one also detects it",
    )
    seek = ((1, Outcome(frames, reject_ids)), (9, Outcome(frames[2:], reject_ids)))
    return replace(vector, seek=seek)


def _make_skipped_ordinals(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams without frame 2; after seeking, frame 3 counts as the first frame."""
    frames, chunks = parent.frames, [*parent.stream.chunks[:4], *parent.stream.chunks[5:-1]]
    index_offset = assemble(chunks).offsets[-2]
    for suffix, without_tail, offset, note in (
        ("", chunks, index_offset, "the ordinal of a CANO is 1 too large"),
        ("-without-index", chunks[:-1], 0, "the same fault in a stream without INDX"),
    ):
        tail = Chunk(b"TAIL", pack_tail(len(frames), 3, offset))
        vector = make_patched_vector(
            parent,
            f"invalid/seek-skipped-ordinal{suffix}",
            "7.2-1 11.2-1",
            [*without_tail, tail],
            Outcome(frames[:2], ("frame-order",)),
            note,
        )
        first = Outcome(frames[1:2], ("frame-order",))
        yield replace(vector, seek=((1, first), *((f, Outcome(frames[f:])) for f in (3, 4))))


def _make_offset_faults(parent: ValidStream) -> Iterable[Vector]:
    count, offsets = len(parent.frames), parent.layout.offsets
    wrong_offsets = {
        "frame": (offsets[3], "index_offset is the offset of a FRAM"),
        "within": (offsets[INDX_CHUNK_INDEX] + 4, "index_offset is an offset within INDX"),
        "itself": (offsets[TAIL_CHUNK_INDEX], "index_offset is the offset of TAIL"),
        "behind": (len(parent.layout.data) + 100, "index_offset is beyond the end of the stream"),
        "greatest": ((1 << 64) - 1, "index_offset is 2^64 - 1"),
        "head": (8, "index_offset is the offset of HEAD"),
    }
    for name, (offset, note) in wrong_offsets.items():
        chunks = parent.stream.replace_chunk(TAIL_CHUNK_INDEX, payload=pack_tail(count, 3, offset))
        yield _make_wrong_index_vector(
            parent, f"seek-to-{name}", "11.2-2", chunks, "tail-mismatch", note
        )


def _make_index_faults(parent: ValidStream) -> Iterable[Vector]:
    layout, chunks = parent.layout, parent.stream.chunks
    count = len(parent.frames)
    with_chunk_between = [
        *chunks[:TAIL_CHUNK_INDEX],
        Chunk(b"note", pack_metadata()),
        chunks[TAIL_CHUNK_INDEX],
    ]
    yield _make_wrong_index_vector(
        parent,
        "seek-index-apart",
        "11.2-2",
        with_chunk_between,
        "chunk-order",
        "a chunk is between INDX and TAIL",
    )
    with_early_index = [
        *chunks[:TAIL_CHUNK_INDEX],
        Chunk(b"note", pack_metadata()),
        replace(chunks[TAIL_CHUNK_INDEX], sequence=TAIL_CHUNK_INDEX),
    ]
    note = "INDX has the sequence number before TAIL's, but does not end where TAIL begins"
    yield _make_wrong_index_vector(
        parent, "seek-index-early", "11.2-2", with_early_index, "chunk-order", note
    )
    with_fewer_canonicals = parent.stream.replace_chunk(
        TAIL_CHUNK_INDEX, payload=pack_tail(count, 2, layout.offsets[INDX_CHUNK_INDEX])
    )
    note = "canonical_count is less than the number of seek points in INDX"
    yield _make_wrong_index_vector(
        parent, "seek-count", "11.2-3", with_fewer_canonicals, "tail-mismatch", note
    )


def _make_wrong_index_vector(
    parent: ValidStream,
    name: str,
    clauses: str,
    chunks: list[Chunk],
    decode_reject_id: str,
    note: str,
) -> Vector:
    """Return a stream that seeking rejects at once, but decoding rejects only after all frames."""
    outcome = Outcome(parent.frames, (decode_reject_id,))
    vector = make_patched_vector(parent, f"invalid/{name}", clauses, chunks, outcome, note)
    return replace(vector, seek=((_REQUESTED_FRAME, Outcome((), ("index-mismatch",))),))


def _make_skipped_faults(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams with a fault that seeking skips, or with a fault in HEAD or INDX."""
    frames, stream = parent.frames, parent.stream
    faults = {
        "payload": (
            stream.replace_chunk(CANO_CHUNK_INDEX, flipped_byte=60),
            3,
            "payload-crc",
            "a payload before the seek point is damaged",
        ),
        "header": (
            stream.replace_chunk(4, flipped_byte=9),
            2,
            "header-crc",
            "a chunk header before the seek point is damaged",
        ),
    }
    for name, (chunks, frames_before, reject_id, note) in faults.items():
        outcome = Outcome(frames[:frames_before], (reject_id,))
        vector = make_patched_vector(
            parent, f"damaged/passed-{name}", "11.2-1", chunks, outcome, note
        )
        yield replace(vector, seek=((_REQUESTED_FRAME, Outcome(frames[_REQUESTED_FRAME:])),))
    head = stream.replace_chunk(0, flipped_byte=30)
    vector = make_patched_vector(
        parent,
        "damaged/passed-head",
        "11.2-1",
        head,
        Outcome((), ("payload-crc",)),
        "HEAD is damaged",
    )
    yield replace(vector, seek=((_REQUESTED_FRAME, Outcome((), ("payload-crc",))),))
    for name, flipped_byte, reject_id, field in (
        ("tail", 28, "payload-crc", "index_offset"),
        ("tail-header", 8, "header-crc", "TAIL's sequence number"),
    ):
        vector = make_patched_vector(
            parent,
            f"damaged/passed-{name}",
            "11.2-1",
            stream.replace_chunk(TAIL_CHUNK_INDEX, flipped_byte=flipped_byte),
            Outcome(frames, (reject_id,)),
            f"one bit of {field} is flipped, so seeking does not use INDX",
        )
        seek = ((_REQUESTED_FRAME, Outcome(frames[_REQUESTED_FRAME:], (reject_id,))),)
        yield replace(vector, seek=seek)
    index = stream.replace_chunk(INDX_CHUNK_INDEX, flipped_byte=-20)
    outcome = Outcome(frames, ("payload-crc",))
    vector = make_patched_vector(
        parent, "damaged/passed-index", "11.2-1", index, outcome, "one bit of INDX is flipped"
    )
    yield replace(vector, seek=((_REQUESTED_FRAME, Outcome((), ("payload-crc",))),))


def _make_streams_without_index(parent: ValidStream) -> Iterable[Vector]:
    frames, stream = parent.frames, parent.stream
    without_index = [*stream.chunks[:INDX_CHUNK_INDEX], stream.chunks[TAIL_CHUNK_INDEX]]
    note = "the stream has no INDX, so seeking reads one chunk header after another"
    vector = make_patched_vector(
        parent,
        "streams/journey-without-index",
        "11.2-1",
        without_index,
        Outcome(frames),
        note,
    )
    yield replace(vector, seek=tuple((f, Outcome(frames[f:])) for f in (1, 3, 5, 8)))
    cut_data = assemble(stream.chunks).data[: parent.layout.offsets[12]]
    outcome = Outcome(frames[:8], ("truncated",))
    vector = make_patched_vector(
        parent,
        "damaged/passed-end",
        "11.2-1 11.3",
        cut_data,
        outcome,
        "the last chunks are missing",
    )
    yield replace(vector, seek=((4, Outcome(frames[4:8], ("truncated",))),))
    with_short_canonical = [
        *without_index[:CANO_CHUNK_INDEX],
        replace(without_index[CANO_CHUNK_INDEX], payload=bytes(3)),
        *without_index[CANO_CHUNK_INDEX + 1 :],
    ]
    outcome, note = (
        Outcome(frames[:3], ("field",)),
        "a CANO before the requested frame has only 3 bytes, and thus no ordinal",
    )
    vector = make_patched_vector(
        parent, "invalid/seek-canonical-short", "11.2-1 5-1", with_short_canonical, outcome, note
    )
    yield replace(vector, seek=((_REQUESTED_FRAME, Outcome((), ("field",))),))
