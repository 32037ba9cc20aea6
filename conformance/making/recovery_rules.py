"""damaged/: streams to which several rules of recovery apply, and their priority (SPEC 11.4)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import INDX, RECOVERY_CLAUSES, TAIL, damaged_by
from making.payloads import pack_chunk, pack_chunk_header, pack_tail
from making.streams import Piece, assemble
from making.vectors import Gap, Outcome, Recovery, Valid, Vector

_FRAM, _LAST = 7, 12
"""Pieces of the journey: FRAM of frame 4, and of frame 8."""


def make_rules(parent: Valid) -> list[Vector]:
    """Return all vectors, as patches of the journey."""
    return [
        *_of_unknown_criticals(parent),
        *_before_the_first_canonical(parent),
        *_of_indexes(parent),
        *_of_tails(parent),
        _old_number(parent),
    ]


def _of_unknown_criticals(parent: Valid) -> Iterable[Vector]:
    """Rejected if no earlier check of the order fails."""
    data, offsets, frames = parent.layout.data, parent.layout.offsets, parent.frames
    at, ids = offsets[_FRAM], ("unknown-critical",)
    damaged = pack_chunk(b"SNAP", _FRAM, bytes(8))[:-1] + b"\xff"
    long = pack_chunk_header(b"SNAP", _FRAM, 1 << 30)
    for name, chunk, others, note in (
        ("damaged", damaged, ("payload-crc",), "its payload is damaged"),
        ("too-long", long, ("chunk-exceeds-level", "truncated"), "it is too long"),
    ):
        said = Outcome(frames[:4], (*ids, *others))
        recovery = Recovery(frames[:4], refused=ids)
        changed = data[:at] + chunk + data[at:]
        note = f"a critical chunk of an unknown type, and {note}"
        yield _vector(parent, f"unknown-critical-{name}", "5.2-9", changed, said, recovery, note)
    pieces = [*parent.stream.pieces[:TAIL], Piece(b"SNAP", bytes(8)), parent.stream.pieces[TAIL]]
    said = Outcome(frames, (*ids, "chunk-order"))
    note = "a critical chunk of an unknown type after INDX"
    recovery = Recovery(frames, refused=ids)
    yield _vector(
        parent, "unknown-critical-behind-index", "5.2-9 5.1-6", pieces, said, recovery, note
    )
    late = parent.stream.replaced(_FRAM, kind=b"SNAP", sequence=_FRAM + 1)
    said = Outcome(frames[:4], ("sequence", *ids))
    gap = Gap(at, offsets[9] - at, ("sequence",), 2)
    recovery = Recovery([*frames[:4], *frames[6:]], (gap,))
    note = "a critical chunk of an unknown type after a lost chunk"
    yield _vector(
        parent, "unknown-critical-out-of-sequence", "5.2-4 5.2-9", late, said, recovery, note
    )


def _before_the_first_canonical(parent: Valid) -> Iterable[Vector]:
    head, cameras, *rest = parent.stream.pieces
    frame = parent.stream.pieces[_FRAM]
    for name, flip_byte, ids, note in (
        ("whole", None, ("chunk-order",), ""),
        ("damaged", 30, ("payload-crc", "chunk-order"), ", and its payload is damaged"),
    ):
        pieces = [head, cameras, replace(frame, flip_byte=flip_byte), *rest]
        offsets = assemble(pieces).offsets
        gap = Gap(offsets[2], offsets[3] - offsets[2], ids[:1], None)
        recovery = Recovery(parent.frames, (gap,))
        note = f"FRAM precedes the first CANO{note}"
        said = Outcome((), ids)
        yield _vector(parent, f"frame-first-{name}", "5.1-3", pieces, said, recovery, note)


def _of_indexes(parent: Valid) -> Iterable[Vector]:
    """INDX within the stream, and INDX after a gap."""
    stream, frames = parent.stream, parent.frames
    within = [*stream.pieces[:5], Piece(b"INDX", None), *stream.pieces[5:]]
    offset = assemble(within).offsets[6]
    recovery = Recovery(frames, (Gap(offset, 0, ("chunk-order",), 0),))
    note = "a CANO after INDX: decoding resumes there"
    said = Outcome(frames[:3], ("chunk-order",))
    yield _vector(parent, "canonical-behind-index", "5.1-6", within, said, recovery, note)
    offsets, data = parent.layout.offsets, parent.layout.data
    index = data[offsets[INDX] + 20 : offsets[TAIL] - 4]
    pieces = stream.replaced(4, flip_byte=30)
    pieces[INDX] = replace(pieces[INDX], payload=index + bytes(1))
    offsets = assemble(pieces).offsets
    gaps = (
        Gap(offsets[4], offsets[5] - offsets[4], ("payload-crc",), 1),
        Gap(offsets[INDX], offsets[TAIL] - offsets[INDX], ("trailing-data",), 0),
    )
    recovery = Recovery([*frames[:2], *frames[3:]], gaps)
    note = "after a gap INDX is not compared with the stream, but its fields are checked"
    said = Outcome(frames[:2], ("payload-crc",))
    yield _vector(parent, "index-longer-behind-a-gap", "5-2", pieces, said, recovery, note)


def _of_tails(parent: Valid) -> Iterable[Vector]:
    """The last frame is damaged, and so are the totals of TAIL."""
    frames, said = parent.frames[:8], Outcome(parent.frames[:8], ("payload-crc",))
    pieces = parent.stream.replaced(_LAST, flip_byte=30)
    fewer = [*pieces[:TAIL], replace(pieces[TAIL], payload=pack_tail(3, 3, 0))]
    offsets = parent.layout.offsets
    at, tail, end = offsets[_LAST], offsets[TAIL], offsets[-1]
    recovery = Recovery(frames, (Gap(at, tail - at, ("payload-crc",), None),))
    note = "TAIL states fewer frames than were decoded: the number of missing frames is unknown"
    yield _vector(parent, "tail-of-fewer-frames", "5.8-1", fewer, said, recovery, note)
    longer = [*pieces[:TAIL], replace(pieces[TAIL], payload=pack_tail(9, 3, 0) + bytes(1))]
    gaps = (
        Gap(at, end + 1 - at, ("payload-crc",), None),
        Gap(end + 1, 0, ("truncated",), None),
    )
    note = "TAIL has an additional byte: decoding does not resume there"
    yield _vector(
        parent, "tail-longer-behind-a-gap", "5-2", longer, said, Recovery(frames, gaps), note
    )


def _old_number(parent: Valid) -> Vector:
    data, offsets, frames = parent.layout.data, parent.layout.offsets, parent.frames
    at, payload = offsets[_FRAM], data[offsets[9] + 20 : offsets[10] - 4]
    junk = b"?" + pack_chunk(b"CANO", _FRAM - 1, payload)
    gap = Gap(at, len(junk) + offsets[9] - at, ("bad-sync",), 2)
    return _vector(
        parent,
        "junk-old-number",
        "5.2-4",
        data[:at] + junk + data[at:],
        Outcome(frames[:4], ("bad-sync",)),
        Recovery([*frames[:4], *frames[6:]], (gap,)),
        "a CANO of a later frame, but with an earlier number",
    )


def _vector(  # a vector cannot be described with less
    parent: Valid,
    name: str,
    clauses: str,
    stream: list[Piece] | bytes,
    said: Outcome,
    recovery: Recovery,
    note: str,
) -> Vector:
    data = stream if isinstance(stream, bytes) else assemble(stream).data
    clauses = f"{clauses} {RECOVERY_CLAUSES}"
    return damaged_by(parent, f"damaged/{name}", clauses, data, said, recovery, note)
