"""Makes vectors in damaged/: streams with snapshots and transmission errors (SPEC 11)."""

from collections.abc import Iterable

from making.fault_rows import RECOVERY_CLAUSES, count_frames, make_damaged_vector
from making.payloads import pack_chunk
from making.streams import assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector

_SNAP_CHUNK_INDEX, _SNAP_ORDINAL = 5, 3
"""Chunk and frame of `streams/snapshots-journey` that hold the first snapshot."""

_SHORT_SNAPSHOT = (245).to_bytes(4, "little") + bytes(3)
"""Payload without the last byte of `canonical`. The first byte of its CRC is 0, so a decoder that
reads beyond the payload also finds a reference to frame 0."""


def make_snapshot_damage(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams with a damaged chunk; if it is a CANO, its snapshots are lost too."""
    rows = (
        (2, 0, 8, None, "first-canonical", "the first CANO"),
        (4, 2, 3, 1, "before", "the frame before a snapshot"),
        (5, 3, 6, 3, "snapshot", "a snapshot"),
        (8, 6, 8, 2, "later-snapshot", "a later snapshot"),
        (10, 8, None, 4, "canonical", "a CANO that is followed by a snapshot"),
        (12, 10, None, 2, "last-snapshot", "the last snapshot"),
    )
    chunks, offsets = parent.stream.chunks, parent.layout.offsets
    for chunk_index, frames_before, resume_frame, frames_lost, name, note in rows:
        damaged_chunks = parent.stream.replace_chunk(chunk_index, flipped_byte=30)
        resume_index = len(chunks) - 1
        if resume_frame is not None:
            resume_index = next(
                n
                for n in range(chunk_index + 1, len(chunks))
                if count_frames(chunks[:n]) == resume_frame and chunks[n].kind in (b"CANO", b"SNAP")
            )
        gap = Gap(
            offsets[chunk_index],
            offsets[resume_index] - offsets[chunk_index],
            ("payload-crc",),
            frames_lost,
        )
        frames = [*parent.frames[:frames_before], *parent.frames[resume_frame or 12 :]]
        yield make_damaged_vector(
            parent,
            f"damaged/snapshots-{name}",
            RECOVERY_CLAUSES,
            assemble(damaged_chunks).data,
            Outcome(parent.frames[:frames_before], ("payload-crc",)),
            Recovery(frames, (gap,)),
            f"one bit of {note} is flipped",
        )


def make_snapshot_junk(parent: ValidStream) -> Iterable[Vector]:
    """Yield streams with a SNAP in their middle at which decoding must not resume."""
    data, offset = parent.layout.data, parent.layout.offsets[_SNAP_CHUNK_INDEX]
    old_snapshot = (_SNAP_ORDINAL - 1).to_bytes(4, "little") + bytes(40)
    for name, sequence, payload, clauses, note in (
        ("short", _SNAP_CHUNK_INDEX, _SHORT_SNAPSHOT, "5-1 ", "a payload of only seven bytes"),
        ("old-ordinal", 60, old_snapshot, "", "a later sequence number and an earlier ordinal"),
    ):
        junk = b"?" + pack_chunk(b"SNAP", sequence, payload)
        yield make_damaged_vector(
            parent,
            f"damaged/snapshots-junk-{name}",
            f"{clauses}{RECOVERY_CLAUSES}",
            data[:offset] + junk + data[offset:],
            Outcome(parent.frames[:_SNAP_ORDINAL], ("bad-sync",)),
            Recovery(parent.frames, (Gap(offset, len(junk), ("bad-sync",), 0),)),
            f"a SNAP with {note}",
        )
