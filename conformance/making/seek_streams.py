"""Random access: faults that seeking detects, and faults that it skips (SPEC 11.2)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import CANO_CHUNK_INDEX, INDX_CHUNK_INDEX, TAIL_CHUNK_INDEX
from making.payloads import pack_metadata, pack_tail
from making.streams import Chunk, assemble
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector

_REQUESTED_FRAME = 7
"""The frame to seek to; decoding starts at the seek point of frame 6."""


def make_seek_faults(parent: ValidStream) -> list[Vector]:
    """Return the vectors of this module, as patches of `streams/journey`."""
    return [
        *_make_offset_faults(parent),
        *_make_index_faults(parent),
        *_make_skipped_faults(parent),
        *_make_streams_without_index(parent),
    ]


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
