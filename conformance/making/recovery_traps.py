"""Makes the streams in damaged/ that detect plausible mistakes in recovery (SPEC 11.4)."""

import zlib
from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import RECOVERY_CLAUSES, TAIL_CHUNK_INDEX, make_damaged_vector
from making.payloads import SYNC, pack_chunk, pack_chunk_header
from making.snapshot_scenes import REQUIRED_CAPABILITY
from making.streams import Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector

_FRAME_4, _CANONICAL_6 = 7, 9
"""Indices of the chunks of `streams/journey` that hold frames 4 and 6."""
_MISLEADING_LENGTH = 40


def make_recovery_traps(
    journey: ValidStream, late_start: ValidStream, snapshots: ValidStream
) -> list[Vector]:
    """Return the vectors.

    Args:
        journey: `streams/journey`.
        late_start: `streams/canonical-after-canonical`, whose first frame has ordinal 7.
        snapshots: `streams/snapshots-journey`.
    """
    return [
        *_make_header_orders(journey),
        _make_overlapping_headers(journey),
        *_make_nested_canonicals(journey),
        *_make_bytes_after_tail(journey),
        _make_unknown_critical_after_gap(journey),
        _make_loss_after_late_start(late_start),
        _make_rejected_reference(snapshots),
    ]


def _make_header_orders(journey: ValidStream) -> Iterable[Vector]:
    """Yield streams with two faults in a header, of which recovery reports the first."""
    offsets, frames, stream = journey.layout.offsets, journey.frames, journey.stream
    gap = Gap(offsets[_FRAME_4], offsets[_CANONICAL_6] - offsets[_FRAME_4], ("sequence",), 2)
    for name, kind, other_id, clauses, note in (
        ("bad-type", b"FR4M", "bad-chunk-type", "5.2-4 5.2-8", "a chunk type with a digit"),
        ("head", b"HEAD", "chunk-order", "5.2-4 5.1-2", "a second HEAD"),
    ):
        chunks = stream.replace_chunk(_FRAME_4, kind=kind, sequence=_FRAME_4 + 1)
        yield _make_vector(
            journey,
            f"{name}-out-of-sequence",
            clauses,
            assemble(chunks).data,
            Outcome(frames[:4], ("sequence", other_id)),
            Recovery([*frames[:4], *frames[6:]], (gap,)),
            f"{note} and a sequence number that is not the next one",
        )
    data, tail_offset = journey.layout.data, offsets[TAIL_CHUNK_INDEX]
    long_header = pack_chunk_header(b"note", TAIL_CHUNK_INDEX, 1 << 30)
    yield _make_vector(
        journey,
        "long-chunk-behind-index",
        "5.1-6 3.2-4",
        data[:tail_offset] + long_header + data[tail_offset:],
        Outcome(frames, ("chunk-order", "chunk-exceeds-level", "truncated")),
        Recovery(frames, (Gap(tail_offset, len(long_header), ("chunk-order",), 0),)),
        "a chunk after INDX that is longer than the level allows",
    )


def _make_overlapping_headers(journey: ValidStream) -> Vector:
    """Return a stream with a misleading header whose CRC is the sync word of the next chunk."""
    data, offsets, frames = journey.layout.data, journey.layout.offsets, journey.frames
    begin, end = offsets[_FRAME_4], offsets[_CANONICAL_6]
    sequence = _find_sequence_number(b"CANO", _MISLEADING_LENGTH)
    header = pack_chunk_header(b"CANO", sequence, _MISLEADING_LENGTH)
    assert header.endswith(SYNC)
    return _make_vector(
        journey,
        "junk-overlapping-headers",
        "5.2-4",
        data[:begin] + header.removesuffix(SYNC) + data[end:],
        Outcome(frames[:4], ("sequence",)),
        Recovery([*frames[:4], *frames[6:]], (Gap(begin, 16, ("sequence",), 2),)),
        "the CRC of a misleading header is the sync word of the CANO at which decoding resumes",
    )


def _find_sequence_number(kind: bytes, length: int) -> int:
    """Return the sequence number with which the CRC of a header is the sync word."""
    register = int.from_bytes(SYNC, "little") ^ 0xFFFFFFFF
    register = _rewind_crc(register) ^ length
    return _rewind_crc(register) ^ zlib.crc32(SYNC + kind) ^ 0xFFFFFFFF


def _rewind_crc(register: int) -> int:
    """Return the CRC register from before 32 zero bits (SPEC 4.5)."""
    for _ in range(32):
        was_odd = register >> 31
        register = (register ^ (0xEDB88320 * was_odd)) << 1 | was_odd
    return register


def _make_nested_canonicals(journey: ValidStream) -> Iterable[Vector]:
    """Yield streams with a CANO within a payload, at which decoding resumes or does not."""
    layout, frames = journey.layout, journey.frames
    offsets, stream = layout.offsets, journey.stream
    payload = stream.chunks[_FRAME_4].payload or b""
    canonical = pack_chunk(b"CANO", _FRAME_4 + 1, stream.chunks[_CANONICAL_6].payload or b"")
    chunks = stream.replace_chunk(_FRAME_4, payload=payload + canonical)
    begin, end = offsets[_FRAME_4], assemble(chunks).offsets[_CANONICAL_6]
    yield _make_vector(
        journey,
        "canonical-in-a-rejected-payload",
        "5-2",
        assemble(chunks).data,
        Outcome(frames[:4], ("trailing-data",)),
        Recovery([*frames[:4], *frames[6:]], (Gap(begin, end - begin, ("trailing-data",), 2),)),
        "a CANO within a payload whose CRC is correct, so the search begins after the payload",
    )
    chunks[_FRAME_4] = replace(chunks[_FRAME_4], flipped_byte=-1)
    damaged = assemble(chunks)
    nested = begin + 20 + len(payload)
    nested_end = nested + len(canonical)
    gaps = (
        Gap(begin, nested - begin, ("payload-crc",), 2),
        Gap(nested_end, damaged.offsets[TAIL_CHUNK_INDEX] - nested_end, ("bad-sync",), 2),
    )
    yield _make_vector(
        journey,
        "canonical-in-a-damaged-payload",
        "5.2-3",
        damaged.data,
        Outcome(frames[:4], ("payload-crc",)),
        Recovery([*frames[:4], frames[6]], gaps),
        "a CANO within a payload whose CRC is wrong, at which decoding resumes",
    )


def _make_bytes_after_tail(journey: ValidStream) -> Iterable[Vector]:
    data, frames = journey.layout.data, journey.frames
    for name, suffix, note in (
        ("bytes", b"\0", "a byte follows TAIL"),
        ("stream", data, "the stream is repeated after TAIL; decoding does not resume there"),
    ):
        yield _make_vector(
            journey,
            f"{name}-after-tail",
            "5.1-5",
            data + suffix,
            Outcome(frames, ("trailing-data",)),
            Recovery(frames, (Gap(len(data), len(suffix), ("trailing-data",), None),)),
            note,
        )


def _make_unknown_critical_after_gap(journey: ValidStream) -> Vector:
    offsets, frames = journey.layout.offsets, journey.frames
    chunks = journey.stream.replace_chunk(_FRAME_4, flipped_byte=30)
    chunks.insert(_CANONICAL_6 + 1, Chunk(b"SNAP", bytes(8)))
    begin, end = offsets[_FRAME_4], offsets[_CANONICAL_6]
    gap = Gap(begin, end - begin, ("payload-crc",), 2)
    return _make_vector(
        journey,
        "unknown-critical-behind-a-gap",
        "5.2-9",
        assemble(chunks).data,
        Outcome(frames[:4], ("payload-crc",)),
        Recovery([*frames[:4], frames[6]], (gap,), ("unknown-critical",)),
        "a critical chunk of an unknown type after a gap",
    )


def _make_loss_after_late_start(late_start: ValidStream) -> Vector:
    stream, offsets, frames = late_start.stream, late_start.layout.offsets, late_start.frames
    frame_index, tail_index = stream.frame_chunk_indices[-1], len(stream.chunks) - 1
    begin, end = offsets[frame_index], offsets[tail_index]
    return _make_vector(
        late_start,
        "last-frame-after-a-late-start",
        "5.2-3",
        assemble(stream.replace_chunk(frame_index, flipped_byte=-1)).data,
        Outcome(frames[:2], ("payload-crc",)),
        Recovery(frames[:2], (Gap(begin, end - begin, ("payload-crc",), 1),)),
        "the last frame is damaged; the ordinal of the first frame is 7",
    )


def _make_rejected_reference(snapshots: ValidStream) -> Vector:
    stream, offsets, frames = snapshots.stream, snapshots.layout.offsets, snapshots.frames
    begin, end = offsets[stream.frame_chunk_indices[8]], offsets[len(stream.chunks) - 1]
    vector = _make_vector(
        snapshots,
        "snapshots-canonical-rejected",
        "9.2-1 7.9-2",
        assemble(stream.replace_frame_fields(8, state_crc=1)).data,
        Outcome(frames[:8], ("state-crc",)),
        Recovery(frames[:8], (Gap(begin, end - begin, ("state-crc",), 4),)),
        "a CANO is rejected, so decoding does not resume at the snapshot that refers to it",
    )
    return replace(vector, **REQUIRED_CAPABILITY)


def _make_vector(
    parent: ValidStream,
    name: str,
    clauses: str,
    data: bytes,
    outcome: Outcome,
    recovery: Recovery,
    note: str,
) -> Vector:
    clauses = f"{clauses} {RECOVERY_CLAUSES}"
    return make_damaged_vector(parent, f"damaged/{name}", clauses, data, outcome, recovery, note)
