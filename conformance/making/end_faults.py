"""invalid/: INDX, TAIL and data after them (SPEC 5.8, 5.9)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import INDX, TAIL
from making.payloads import pack_index, pack_tail
from making.streams import Piece
from making.vectors import Outcome, Valid, Vector, broken

_MISLEADING = ("-offset", "-sequence", "-frame", "-less", "-more", "-empty")
End = tuple[str, str, str, list[Piece] | bytes, str]
"""Name, clauses, reject ids, bytes, and description."""


def make_ends(parent: Valid) -> list[Vector]:
    """Return all vectors: every frame is decoded before they are rejected."""
    vectors = []
    # A payload that is too short can also be rejected for the fields that it has.
    for name, clauses, ids, there, note in [
        *_of_payloads(parent),
        *_of_places(parent),
        *_of_indexes(parent),
        *_of_tails(parent),
    ]:
        said = Outcome(parent.frames, tuple(ids.split()))
        vector = broken(parent, f"invalid/{name}", clauses, there, said, note)
        vectors.append(replace(vector, seek=_seek_results(name)))
    return vectors


def _of_payloads(parent: Valid) -> Iterable[End]:
    index, tail = pack_index(_points(parent)), pack_tail(*_totals(parent))
    endless, note = b"\xff" * 4 + index[4:], "INDX claims 2^32 - 1 seek points"
    cases = {
        "tail-shorter": (TAIL, bytes(15), "5-1", "field tail-mismatch", "TAIL of 15 bytes"),
        "tail-longer": (TAIL, tail + b"\0", "5-2", "trailing-data", "TAIL of 17 bytes"),
        "index-count": (INDX, endless, "5-1", "field index-mismatch", note),
        "index-longer": (INDX, index + b"\0", "5-2", "trailing-data", "a byte after INDX"),
    }
    for name, (place, payload, clauses, ids, note) in cases.items():
        yield name, clauses, ids, parent.stream.replaced(place, payload=payload), note


def _of_places(parent: Valid) -> Iterable[End]:
    stream, data = parent.stream, parent.layout.data
    more = stream.before(Piece(b"note", b""), place=TAIL + 1)
    lone = [*stream.pieces[:INDX], Piece(b"TAIL", pack_tail(*_totals(parent)))]
    behind = ("5.1-5", "trailing-data")
    yield "after-tail", *behind, data + b"\0", "a byte after TAIL"
    yield "after-tail-chunk", *behind, more, "a chunk after TAIL"
    yield "after-tail-stream", *behind, data * 2, "the stream is repeated"
    note = "TAIL states an offset of INDX, which is missing"
    yield "index-offset-of-none", "5.8-1", "tail-mismatch", lone, note
    yield "no-tail", "5.1-4", "truncated", stream.pieces[:TAIL], "the stream ends after INDX"


def _of_indexes(parent: Valid) -> Iterable[End]:
    first, (offset, sequence, frame), last = points = _points(parent)
    indexes = {
        "index-offset": (
            [first, (offset + 1, sequence, frame), last],
            "an offset is too large by one",
        ),
        "index-sequence": ([first, (offset, sequence + 1, frame), last], "a sequence number"),
        "index-frame": ([first, (offset, sequence, frame + 1), last], "an ordinal"),
        "index-order": ([points[1], first, last], "two seek points are swapped"),
        "index-less": (points[:2], "a seek point is missing"),
        "index-more": ([*points, last], "a seek point is repeated"),
        "index-empty": ([], "INDX without seek points in a stream with frames"),
    }
    for name, (listed, note) in indexes.items():
        pieces = parent.stream.replaced(INDX, payload=pack_index(listed))
        yield name, "5.9-1 5.9-2", "index-mismatch", pieces, note


def _of_tails(parent: Valid) -> Iterable[End]:
    frames, canonicals, offset = _totals(parent)
    tails = {
        "tail-frames": (pack_tail(frames + 1, canonicals, offset), "frame_count"),
        "tail-canonicals": (pack_tail(frames, canonicals - 1, offset), "canonical_count"),
        "tail-index": (pack_tail(frames, canonicals, offset + 1), "index_offset"),
        "tail-no-index": (
            pack_tail(frames, canonicals, 0),
            "index_offset is 0 although INDX exists",
        ),
    }
    for name, (payload, note) in tails.items():
        pieces = parent.stream.replaced(TAIL, payload=payload)
        yield name, "5.8-1 5.8-2", "tail-mismatch", pieces, note


def _seek_results(name: str) -> tuple[tuple[int, Outcome], ...]:
    """The results of seeking with an INDX that is wrong on the way to frame 4."""
    misleading = name.startswith("index-") and name.endswith(_MISLEADING)
    return ((4, Outcome((), ("index-mismatch",))),) if misleading else ()


def _totals(parent: Valid) -> tuple[int, int, int]:
    """The correct totals of TAIL."""
    return len(parent.frames), len(_points(parent)), parent.layout.offsets[INDX]


def _points(parent: Valid) -> list[tuple[int, int, int]]:
    pieces, offsets = parent.stream.pieces, parent.layout.offsets
    places = [n for n, piece in enumerate(pieces) if piece.kind == b"CANO"]
    return [(offsets[n], n, frame) for n, frame in zip(places, (0, 3, 6), strict=True)]
