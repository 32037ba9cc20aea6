"""invalid/: one fault in the container of a stream (SPEC 5.1, 5.2, 5.8, 5.9, 12)."""

from collections.abc import Iterable
from dataclasses import replace

from making.end_faults import make_ends
from making.fault_rows import CAME, FRAM, HEAD, INDX, META, NOTE, TAIL, Row, count_frames, faults_at
from making.head_faults import make_beginnings
from making.payloads import pack_metadata
from making.streams import Piece, assemble
from making.vectors import Gap, Outcome, Recovery, Valid, Vector, broken


def make_container_faults(parent: Valid) -> list[Vector]:
    """Return all vectors, as patches of the journey."""
    rows = [*_of_framing(parent), *_of_types(parent)]
    return [
        *faults_at(parent, FRAM, rows),
        *make_beginnings(parent),
        *_of_order(parent),
        *make_ends(parent),
        *_of_ancillaries(parent),
    ]


def _of_framing(parent: Valid) -> Iterable[Row]:
    stream = parent.stream
    spoiled: list[tuple[str, str, str, int, str]] = [
        ("sync", "5.2-1", "bad-sync", 0, "the first bit of a sync word"),
        ("sync-end", "5.2-1", "bad-sync", 3, "a bit of the last byte of a sync word"),
        ("header-crc-of-the-type", "5.2-2 5.2-5", "header-crc", 4, "a bit of a type"),
        (
            "header-crc-of-the-sequence",
            "5.2-2 5.2-5",
            "header-crc",
            8,
            "a bit of a sequence number",
        ),
        (
            "header-crc-of-the-length",
            "5.2-2 5.2-5",
            "header-crc",
            15,
            "a bit of a length, which becomes 16 MiB",
        ),
        ("header-crc", "5.2-2", "header-crc", 16, "a bit of a header's CRC"),
        ("payload-crc-of-the-payload", "5.2-3 5.2-5", "payload-crc", 25, "a bit of a payload"),
        ("payload-crc", "5.2-3", "payload-crc", -1, "a bit of a payload's CRC"),
    ]
    for name, clauses, ids, place, note in spoiled:
        yield name, clauses, ids, stream.replaced(FRAM, flip_byte=place), note
    yield (
        "payload-crc-of-zero",
        "5.2-3",
        "payload-crc",
        _zero_crc(stream.pieces),
        "a CRC of 0 does not mean that there is none",
    )
    yield (
        "sequence-skipped",
        "5.2-4",
        "sequence",
        stream.replaced(FRAM, sequence=FRAM + 1),
        "a number is skipped",
    )
    yield (
        "sequence-repeated",
        "5.2-4",
        "sequence",
        stream.replaced(FRAM, sequence=FRAM - 1),
        "a number is repeated",
    )
    yield (
        "sequence-from-zero",
        "5.2-4 5.1-2",
        "sequence",
        stream.replaced(FRAM, sequence=0),
        "numbering starts again",
    )


def _zero_crc(pieces: list[Piece]) -> list[Piece]:
    """A payload CRC of 0: only its four bytes differ."""
    return [*pieces[:FRAM], _ZeroCrc(pieces[FRAM].kind, pieces[FRAM].payload), *pieces[FRAM + 1 :]]


class _ZeroCrc(Piece):
    def pack(self, number: int, payload: bytes) -> bytes:
        return super().pack(number, payload)[:-4] + bytes(4)


def _of_types(parent: Valid) -> Iterable[Row]:
    types = {
        "digit": (b"FR4M", "bad-chunk-type", "a digit"),
        "space": (b"FRA ", "bad-chunk-type", "a space"),
        "mixed-case": (b"FRaM", "bad-chunk-type", "the third letter in lower case"),
        "mixed-case-ancillary": (b"caMe", "bad-chunk-type", "the third letter in upper case"),
        "last-case": (b"FRAm", "bad-chunk-type", "the fourth letter in lower case"),
        "latin-1": (b"FR\xc1M", "bad-chunk-type", "a letter that is not in ASCII"),
        "bracket": (b"[RAM", "bad-chunk-type", "the byte after Z"),
        "zeros": (bytes(4), "bad-chunk-type", "four zeros"),
    }
    for name, (kind, ids, note) in types.items():
        yield (
            f"type-{name}",
            "5.2-8",
            ids,
            parent.stream.replaced(FRAM, kind=kind),
            f"{note} in a chunk type",
        )


def _of_order(parent: Valid) -> list[Vector]:
    """Chunks in places where their types are not allowed."""
    stream, ids = parent.stream, "chunk-order"
    head, index, tail = stream.pieces[HEAD], Piece(b"INDX", None), Piece(b"TAIL", None)
    later = stream.before(head, place=FRAM)
    early = [head, *stream.pieces[3:5], stream.pieces[2], *stream.pieces[5:]]
    between = [*stream.pieces[:INDX], index, Piece(b"meta", pack_metadata()), tail]
    twice, end = stream.before(index, place=TAIL), len(parent.frames)
    note = "another HEAD, with the expected number"
    rows = (
        ("head-not-first", "5.1-2", ids, stream.pieces[1:], 0, "the first chunk is `came`"),
        ("head-missing", "5.1-2", ids, stream.pieces[2:], 0, "the first chunk is CANO"),
        ("frame-before-canonical", "5.1-3", ids, early, 0, "FRAM precedes any CANO"),
        ("chunk-after-index", "5.1-6", ids, between, end, "`meta` is between INDX and TAIL"),
        ("index-twice", "5.1-6", ids, twice, end, "INDX comes twice"),
        *_of_criticals(parent),
    )
    return [
        *faults_at(parent, FRAM, [("head-later", "5.1-2", ids, later, note)]),
        *(_found_after(parent, *row) for row in rows),
    ]


def _of_criticals(parent: Valid) -> Iterable[tuple[str, str, str, list[Piece], int, str]]:
    stream, ids = parent.stream, "unknown-critical"
    reserved = stream.before(Piece(b"SNAP", bytes(8)), place=FRAM)
    private = stream.before(Piece(b"FrAM", bytes(8)), place=FRAM)
    number = stream.replaced(HEAD, sequence=1)
    yield "critical", "5.2-9", ids, reserved, 4, "a critical chunk of a reserved type"
    yield "critical-private", "5.2-9", ids, private, 4, "a critical chunk of a private type"
    yield "head-number", "5.2-4", "sequence chunk-order", number, 0, "HEAD has the number 1"


def _found_after(
    parent: Valid, name: str, clauses: str, ids: str, pieces: list[Piece], frames: int, note: str
) -> Vector:
    """A fault that is found after a number of frames, and is not tested with recovery here."""
    said = Outcome(parent.frames[:frames], tuple(ids.split()))
    return broken(parent, f"invalid/{name}", clauses, pieces, said, note)


def _of_ancillaries(parent: Valid) -> list[Vector]:
    """Faults in the framing of skipped chunks."""
    stream = parent.stream
    vectors = []
    for name, place, flip_byte in (("note", NOTE, 22), ("came", CAME, 40), ("meta", META, 30)):
        pieces = stream.replaced(place, flip_byte=flip_byte)
        before = count_frames(pieces[:place])
        layout = assemble(pieces)
        gap = Gap(
            layout.offsets[place],
            layout.offsets[place + 1] - layout.offsets[place],
            ("payload-crc",),
            0,
        )
        outcome = Outcome(parent.frames[:before], ("payload-crc",))
        note = f"a bit of the payload of `{name}`, which is still checked"
        vector = broken(
            parent, f"invalid/payload-crc-of-{name}", "5.2-3 5.2-10", pieces, outcome, note
        )
        vectors.append(replace(vector, recover=Recovery(parent.frames, (gap,))))
    return vectors
