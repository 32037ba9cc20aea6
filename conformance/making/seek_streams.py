"""Random access: faults on the way to a frame, and faults that seeking skips (SPEC 11.2)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import CANO, INDX, TAIL
from making.payloads import pack_metadata, pack_tail
from making.streams import Piece, assemble
from making.vectors import Outcome, Valid, Vector, broken

_WANTED = 7
"""The requested frame; its seek point is frame 6."""


def make_seeks(parent: Valid) -> list[Vector]:
    """Return all vectors, as patches of the journey."""
    return [
        *_of_offsets(parent),
        *_of_index(parent),
        *_skipped_faults(parent),
        *_without_index(parent),
    ]


def _of_offsets(parent: Valid) -> Iterable[Vector]:
    count, offsets = len(parent.frames), parent.layout.offsets
    places = {
        "frame": (offsets[3], "index_offset is that of a FRAM"),
        "within": (offsets[INDX] + 4, "index_offset is within INDX"),
        "itself": (offsets[TAIL], "index_offset is that of TAIL"),
        "behind": (len(parent.layout.data) + 100, "index_offset is beyond the end"),
        "greatest": ((1 << 64) - 1, "index_offset is 2^64 - 1"),
        "head": (8, "index_offset is that of HEAD"),
    }
    for name, (offset, note) in places.items():
        pieces = parent.stream.replaced(TAIL, payload=pack_tail(count, 3, offset))
        yield _wrong_index(parent, f"seek-to-{name}", "11.2-2", pieces, "tail-mismatch", note)


def _of_index(parent: Valid) -> Iterable[Vector]:
    layout, pieces = parent.layout, parent.stream.pieces
    count = len(parent.frames)
    separated = [*pieces[:TAIL], Piece(b"note", pack_metadata()), pieces[TAIL]]
    yield _wrong_index(
        parent,
        "seek-index-apart",
        "11.2-2",
        separated,
        "chunk-order",
        "a chunk is between INDX and TAIL",
    )
    early = [*pieces[:TAIL], Piece(b"note", pack_metadata()), replace(pieces[TAIL], sequence=TAIL)]
    note = "INDX has the number before TAIL's, but does not end at TAIL"
    yield _wrong_index(parent, "seek-index-early", "11.2-2", early, "chunk-order", note)
    fewer = parent.stream.replaced(TAIL, payload=pack_tail(count, 2, layout.offsets[INDX]))
    note = "canonical_count is less than the number of seek points in INDX"
    yield _wrong_index(parent, "seek-count", "11.2-3", fewer, "tail-mismatch", note)


def _wrong_index(
    parent: Valid, name: str, clauses: str, pieces: list[Piece], read: str, note: str
) -> Vector:
    """A stream that seeking rejects at once, and reading through only at the end, by another id."""
    said = Outcome(parent.frames, (read,))
    vector = broken(parent, f"invalid/{name}", clauses, pieces, said, note)
    return replace(vector, seek=((_WANTED, Outcome((), ("index-mismatch",))),))


def _skipped_faults(parent: Valid) -> Iterable[Vector]:
    """A fault that is found by reading through, and not by seeking."""
    frames, stream = parent.frames, parent.stream
    spoiled = {
        "payload": (
            stream.replaced(CANO, flip_byte=60),
            3,
            "payload-crc",
            "a payload before the seek point",
        ),
        "header": (
            stream.replaced(4, flip_byte=9),
            2,
            "header-crc",
            "a header before the seek point",
        ),
    }
    for name, (pieces, before, ids, note) in spoiled.items():
        said = Outcome(frames[:before], (ids,))
        vector = broken(parent, f"damaged/passed-{name}", "11.2-1", pieces, said, note)
        yield replace(vector, seek=((_WANTED, Outcome(frames[_WANTED:])),))
    head = stream.replaced(0, flip_byte=30)
    vector = broken(
        parent, "damaged/passed-head", "11.2-1", head, Outcome((), ("payload-crc",)), "HEAD"
    )
    yield replace(vector, seek=((_WANTED, Outcome((), ("payload-crc",))),))
    index = stream.replaced(INDX, flip_byte=-20)
    said = Outcome(frames, ("payload-crc",))
    vector = broken(parent, "damaged/passed-index", "11.2-1", index, said, "a bit of INDX")
    yield replace(vector, seek=((_WANTED, Outcome((), ("payload-crc",))),))


def _without_index(parent: Valid) -> Iterable[Vector]:
    frames, stream = parent.frames, parent.stream
    unindexed = [*stream.pieces[:INDX], stream.pieces[TAIL]]
    note = "no INDX: seeking goes from chunk header to chunk header"
    vector = broken(
        parent,
        "streams/journey-without-index",
        "11.2-1",
        unindexed,
        Outcome(frames),
        note,
    )
    yield replace(vector, seek=tuple((f, Outcome(frames[f:])) for f in (1, 3, 5, 8)))
    cut = assemble(stream.pieces).data[: parent.layout.offsets[12]]
    said = Outcome(frames[:8], ("truncated",))
    vector = broken(parent, "damaged/passed-end", "11.2-1 11.3", cut, said, "the end is missing")
    yield replace(vector, seek=((4, Outcome(frames[4:8], ("truncated",))),))
    short = [
        *unindexed[:CANO],
        replace(unindexed[CANO], payload=bytes(3)),
        *unindexed[CANO + 1 :],
    ]
    said, note = Outcome(frames[:3], ("field",)), "a CANO of 3 bytes on the way has no ordinal"
    vector = broken(parent, "invalid/seek-canonical-short", "11.2-1 5-1", short, said, note)
    yield replace(vector, seek=((_WANTED, Outcome((), ("field",))),))
