"""invalid/: INDX, TAIL and what follows them (SPEC 5.8, 5.9)."""

from dataclasses import replace

from making.fault_rows import INDX, TAIL
from making.payloads import pack_index, pack_tail
from making.streams import Piece
from making.vectors import Outcome, Valid, Vector, broken


def make_ends(parent: Valid) -> list[Vector]:
    """Return all of them."""
    stream, layout, frames = parent.stream, parent.layout, parent.frames
    points = _points(parent)
    other = (points[1][0] + 1, *points[1][1:])
    indexes = {
        "index-offset": (
            [points[0], other, points[2]],
            "an offset of a seek point is one byte late",
        ),
        "index-sequence": (
            [points[0], (points[1][0], points[1][1] + 1, 3), points[2]],
            "a sequence number of a seek point",
        ),
        "index-frame": ([points[0], (*points[1][:2], 4), points[2]], "an ordinal of a seek point"),
        "index-order": ([points[1], points[0], points[2]], "two seek points change places"),
        "index-less": (points[:2], "a seek point is missing"),
        "index-more": ([*points, points[2]], "a seek point comes twice"),
        "index-empty": ([], "INDX without seek points in a stream with frames"),
    }
    count, canonicals, at = len(frames), len(points), layout.offsets[INDX]
    tails = {
        "tail-frames": (pack_tail(count + 1, canonicals, at), "frame_count"),
        "tail-canonicals": (pack_tail(count, canonicals - 1, at), "canonical_count"),
        "tail-index": (pack_tail(count, canonicals, at + 1), "index_offset"),
        "tail-no-index": (pack_tail(count, canonicals, 0), "index_offset is 0 and INDX is there"),
    }
    ends: list[tuple[str, str, str, list[Piece] | bytes, str]] = [
        (
            "tail-shorter",
            "5-1",
            "field",
            stream.replaced(TAIL, payload=bytes(15)),
            "TAIL of 15 bytes",
        ),
        (
            "tail-longer",
            "5-2",
            "trailing-data",
            stream.replaced(TAIL, payload=pack_tail(count, canonicals, at) + b"\0"),
            "TAIL of 17 bytes",
        ),
        (
            "index-count",
            "5-1",
            "field",
            stream.replaced(INDX, payload=b"\xff" * 4 + pack_index(points)[4:]),
            "INDX says to have 2^32 - 1 seek points",
        ),
        (
            "index-longer",
            "5-2",
            "trailing-data",
            stream.replaced(INDX, payload=pack_index(points) + b"\0"),
            "a byte after the last seek point",
        ),
        ("after-tail", "5.1-5", "trailing-data", layout.data + b"\0", "a byte after TAIL"),
        (
            "after-tail-chunk",
            "5.1-5",
            "trailing-data",
            stream.before(Piece(b"note", b""), place=TAIL + 1),
            "a chunk after TAIL",
        ),
        ("after-tail-stream", "5.1-5", "trailing-data", layout.data * 2, "the stream comes twice"),
        (
            "index-offset-of-none",
            "5.8-1",
            "tail-mismatch",
            [*stream.pieces[:INDX], Piece(b"TAIL", pack_tail(count, canonicals, at))],
            "TAIL tells where INDX is, and there is none",
        ),
        ("no-tail", "5.1-4", "truncated", stream.pieces[:TAIL], "the stream ends after INDX"),
    ]
    ends += [
        (
            name,
            "5.9-1 5.9-2",
            "index-mismatch",
            stream.replaced(INDX, payload=pack_index(listed)),
            note,
        )
        for name, (listed, note) in indexes.items()
    ]
    ends += [
        (name, "5.8-1 5.8-2", "tail-mismatch", stream.replaced(TAIL, payload=payload), note)
        for name, (payload, note) in tails.items()
    ]
    vectors = []
    for name, clauses, ids, changed, note in ends:
        outcome = Outcome(frames, (ids,))
        vector = broken(parent, f"invalid/{name}", clauses, changed, outcome, note)
        if name in indexes:
            vector = replace(vector, seek=_through(name))
        vectors.append(vector)
    return vectors


def _through(name: str) -> tuple[tuple[int, Outcome], ...]:
    """What is to come of seeking by an INDX that says something else of the way to frame 4."""
    if name in {"index-frame", "index-order"}:
        return ()
    return ((4, Outcome((), ("index-mismatch",))),)


def _points(parent: Valid) -> list[tuple[int, int, int]]:
    pieces, offsets = parent.stream.pieces, parent.layout.offsets
    places = [n for n, piece in enumerate(pieces) if piece.kind == b"CANO"]
    return [(offsets[n], n, frame) for n, frame in zip(places, (0, 3, 6), strict=True)]
