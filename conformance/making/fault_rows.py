"""Rows of faults at a piece of the journey, and their expected results."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from making.streams import FRAMES, Piece, assemble
from making.vectors import Gap, Outcome, Recovery, Valid, Vector, broken

HEAD, CAME, CANO, META, FRAM, NOTE, INDX, TAIL = 0, 1, 5, 6, 7, 11, 13, 14
"""Pieces of `streams/journey`: CANO is frame 3, FRAM frame 4."""


Row = tuple[str, str, str, list[Piece], str]
"""Name, clauses, reject ids, pieces and description."""


def resumed(parent: Valid, pieces: list[Piece], place: int, ids: Sequence[str]) -> Recovery:
    """Return the result of recovery if it resumes at the CANO after a fault."""
    layout = assemble(pieces)
    later = next(n for n in range(place + 1, len(pieces)) if pieces[n].kind in (b"CANO", b"TAIL"))
    before = count_frames(pieces[:place])
    lost = count_frames(pieces[place + 1 : later])
    lost += count_frames(
        (parent.stream.pieces if len(pieces) == len(parent.stream.pieces) else pieces)[
            place : place + 1
        ]
    )
    start, end = layout.offsets[place], layout.offsets[later]
    frames = [*parent.frames[:before], *parent.frames[before + lost :]]
    return Recovery(frames, (Gap(start, end - start, tuple(ids), lost),))


def count_frames(pieces: Iterable[Piece]) -> int:
    """Return the number of frames in pieces."""
    return sum(piece.kind in FRAMES for piece in pieces)


def faults_at(parent: Valid, place: int, rows: Iterable[Row]) -> list[Vector]:
    """Return vectors with a fault at a piece of the journey."""
    vectors = []
    for name, clauses, ids, pieces, note in rows:
        refused = tuple(ids.split())
        before = count_frames(parent.stream.pieces[:place])
        outcome = Outcome(parent.frames[:before], refused)
        vector = broken(parent, f"invalid/{name}", clauses, pieces, outcome, note)
        if place >= CANO:
            vector = replace(vector, recover=resumed(parent, pieces, place, refused))
        vectors.append(vector)
    return vectors


RECOVERY_CLAUSES = "1-3 11.4-1 11.4-2 11.4-3"


def damaged_by(
    parent: Valid,
    name: str,
    clauses: str,
    data: bytes,
    said: Outcome,
    recovery: Recovery,
    note: str,
) -> Vector:
    """Return a patch with the results of reading through it and of recovery."""
    return replace(broken(parent, name, clauses, data, said, note), recover=recovery)


MOVED = 4


def with_fields(parent: Valid, number: int, **said: object) -> list[Piece]:
    """Return the pieces with changed fields in the payload of a frame."""
    return parent.stream.frame_with(number, **said)
