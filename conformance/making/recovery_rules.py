"""Makes the streams in damaged/ to which several recovery rules apply (SPEC 11.4)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import (
    INDX_CHUNK_INDEX,
    RECOVERY_CLAUSES,
    TAIL_CHUNK_INDEX,
    make_damaged_vector,
)
from making.payloads import pack_chunk, pack_chunk_header, pack_tail
from making.streams import Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector

_FRAME_4_CHUNK_INDEX, _FRAME_8_CHUNK_INDEX = 7, 12
"""Indices of the chunks of `streams/journey` that hold frames 4 and 8."""


def make_recovery_vectors(parent: ValidStream) -> list[Vector]:
    """Return the vectors of this module, as patches of `streams/journey`."""
    return [
        *_make_unknown_critical_vectors(parent),
        *_make_frame_first_vectors(parent),
        *_make_index_vectors(parent),
        *_make_tail_vectors(parent),
        *_make_junk_vectors(parent),
    ]


def _make_unknown_critical_vectors(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams with an unknown critical chunk and a second fault."""
    data, offsets, frames = parent.layout.data, parent.layout.offsets, parent.frames
    offset, reject_ids = offsets[_FRAME_4_CHUNK_INDEX], ("unknown-critical",)
    damaged_chunk = pack_chunk(b"SNAP", _FRAME_4_CHUNK_INDEX, bytes(8))[:-1] + b"\xff"
    long_chunk = pack_chunk_header(b"SNAP", _FRAME_4_CHUNK_INDEX, 1 << 30)
    for name, chunk, other_reject_ids, note in (
        ("damaged", damaged_chunk, ("payload-crc",), "whose payload is damaged"),
        ("too-long", long_chunk, ("chunk-exceeds-level", "truncated"), "that is too long"),
    ):
        outcome = Outcome(frames[:4], (*reject_ids, *other_reject_ids))
        recovery = Recovery(frames[:4], reject_ids=reject_ids)
        changed_data = data[:offset] + chunk + data[offset:]
        note = f"a critical chunk of an unknown type {note}"
        yield _make_recovery_vector(
            parent, f"unknown-critical-{name}", "5.2-9", changed_data, outcome, recovery, note
        )
    chunks = [
        *parent.stream.chunks[:TAIL_CHUNK_INDEX],
        Chunk(b"SNAP", bytes(8)),
        parent.stream.chunks[TAIL_CHUNK_INDEX],
    ]
    outcome = Outcome(frames, (*reject_ids, "chunk-order"))
    note = "a critical chunk of an unknown type after INDX"
    recovery = Recovery(frames, reject_ids=reject_ids)
    yield _make_recovery_vector(
        parent, "unknown-critical-behind-index", "5.2-9 5.1-6", chunks, outcome, recovery, note
    )
    out_of_sequence = parent.stream.replace_chunk(
        _FRAME_4_CHUNK_INDEX, kind=b"SNAP", sequence=_FRAME_4_CHUNK_INDEX + 1
    )
    outcome = Outcome(frames[:4], ("sequence", *reject_ids))
    gap = Gap(offset, offsets[9] - offset, ("sequence",), 2)
    recovery = Recovery([*frames[:4], *frames[6:]], (gap,))
    note = "a critical chunk of an unknown type after a lost chunk"
    yield _make_recovery_vector(
        parent,
        "unknown-critical-out-of-sequence",
        "5.2-4 5.2-9",
        out_of_sequence,
        outcome,
        recovery,
        note,
    )


def _make_frame_first_vectors(parent: ValidStream) -> Iterable[Vector]:
    head, cameras, *later_chunks = parent.stream.chunks
    frame = parent.stream.chunks[_FRAME_4_CHUNK_INDEX]
    for name, flipped_byte, reject_ids, note in (
        ("whole", None, ("chunk-order",), ""),
        ("damaged", 30, ("payload-crc", "chunk-order"), ", and its payload is damaged"),
    ):
        chunks = [head, cameras, replace(frame, flipped_byte=flipped_byte), *later_chunks]
        offsets = assemble(chunks).offsets
        gap = Gap(offsets[2], offsets[3] - offsets[2], reject_ids[:1], None)
        recovery = Recovery(parent.frames, (gap,))
        note = f"a FRAM precedes the first CANO{note}"
        outcome = Outcome((), reject_ids)
        yield _make_recovery_vector(
            parent, f"frame-first-{name}", "5.1-3", chunks, outcome, recovery, note
        )


def _make_index_vectors(parent: ValidStream) -> Iterable[Vector]:
    """Yield a stream with INDX in its middle, and one with a malformed INDX after a gap."""
    stream, frames = parent.stream, parent.frames
    with_index_inside = [*stream.chunks[:5], Chunk(b"INDX", None), *stream.chunks[5:]]
    offset = assemble(with_index_inside).offsets[6]
    recovery = Recovery(frames, (Gap(offset, 0, ("chunk-order",), 0),))
    note = "decoding resumes at a CANO that follows INDX"
    outcome = Outcome(frames[:3], ("chunk-order",))
    yield _make_recovery_vector(
        parent, "canonical-behind-index", "5.1-6", with_index_inside, outcome, recovery, note
    )
    offsets, data = parent.layout.offsets, parent.layout.data
    index = data[offsets[INDX_CHUNK_INDEX] + 20 : offsets[TAIL_CHUNK_INDEX] - 4]
    chunks = stream.replace_chunk(4, flipped_byte=30)
    chunks[INDX_CHUNK_INDEX] = replace(chunks[INDX_CHUNK_INDEX], payload=index + bytes(1))
    offsets = assemble(chunks).offsets
    gaps = (
        Gap(offsets[4], offsets[5] - offsets[4], ("payload-crc",), 1),
        Gap(
            offsets[INDX_CHUNK_INDEX],
            offsets[TAIL_CHUNK_INDEX] - offsets[INDX_CHUNK_INDEX],
            ("trailing-data",),
            0,
        ),
    )
    recovery = Recovery([*frames[:2], *frames[3:]], gaps)
    note = "after a gap, INDX is not compared with the stream, but its fields are checked"
    outcome = Outcome(frames[:2], ("payload-crc",))
    yield _make_recovery_vector(
        parent, "index-longer-behind-a-gap", "5-2", chunks, outcome, recovery, note
    )


def _make_tail_vectors(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams whose last frame is damaged and whose TAIL is wrong."""
    frames, outcome = parent.frames[:8], Outcome(parent.frames[:8], ("payload-crc",))
    chunks = parent.stream.replace_chunk(_FRAME_8_CHUNK_INDEX, flipped_byte=30)
    with_fewer_frames = [
        *chunks[:TAIL_CHUNK_INDEX],
        replace(chunks[TAIL_CHUNK_INDEX], payload=pack_tail(3, 3, 0)),
    ]
    offsets = parent.layout.offsets
    offset, tail_offset, end_offset = (
        offsets[_FRAME_8_CHUNK_INDEX],
        offsets[TAIL_CHUNK_INDEX],
        offsets[-1],
    )
    recovery = Recovery(frames, (Gap(offset, tail_offset - offset, ("payload-crc",), None),))
    note = "TAIL states fewer frames than were decoded, so the number of lost frames is unknown"
    yield _make_recovery_vector(
        parent, "tail-of-fewer-frames", "5.8-1", with_fewer_frames, outcome, recovery, note
    )
    with_longer_tail = [
        *chunks[:TAIL_CHUNK_INDEX],
        replace(chunks[TAIL_CHUNK_INDEX], payload=pack_tail(9, 3, 0) + bytes(1)),
    ]
    gaps = (
        Gap(offset, end_offset + 1 - offset, ("payload-crc",), None),
        Gap(end_offset + 1, 0, ("truncated",), None),
    )
    note = "TAIL has an additional byte, so decoding does not resume there"
    yield _make_recovery_vector(
        parent,
        "tail-longer-behind-a-gap",
        "5-2",
        with_longer_tail,
        outcome,
        Recovery(frames, gaps),
        note,
    )


def _make_junk_vectors(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams with a CANO in their middle at which decoding does not resume."""
    data, offsets, frames = parent.layout.data, parent.layout.offsets, parent.frames
    offset, payload = offsets[_FRAME_4_CHUNK_INDEX], data[offsets[9] + 20 : offsets[10] - 4]
    earlier = pack_chunk(b"CANO", _FRAME_4_CHUNK_INDEX - 1, payload)
    short = pack_chunk(b"CANO", _FRAME_4_CHUNK_INDEX, payload[:3])
    for name, clauses, chunk, note in (
        ("old-number", "5.2-4", earlier, "a later ordinal but an earlier sequence number"),
        ("short-canonical", "5-1", short, "a payload of only three bytes"),
    ):
        junk = b"?" + chunk
        gap = Gap(offset, len(junk) + offsets[9] - offset, ("bad-sync",), 2)
        yield _make_recovery_vector(
            parent,
            f"junk-{name}",
            clauses,
            data[:offset] + junk + data[offset:],
            Outcome(frames[:4], ("bad-sync",)),
            Recovery([*frames[:4], *frames[6:]], (gap,)),
            f"a CANO with {note}",
        )


def _make_recovery_vector(
    parent: ValidStream,
    name: str,
    clauses: str,
    stream: list[Chunk] | bytes,
    outcome: Outcome,
    recovery: Recovery,
    note: str,
) -> Vector:
    data = stream if isinstance(stream, bytes) else assemble(stream).data
    clauses = f"{clauses} {RECOVERY_CLAUSES}"
    return make_damaged_vector(parent, f"damaged/{name}", clauses, data, outcome, recovery, note)
