"""Turns rows that describe faults in `streams/journey` into vectors with the expected output."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from making.streams import FRAME_TYPES, Piece, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector, make_broken_vector

HEAD_PIECE, CAME_PIECE, CANO_PIECE, META_PIECE, FRAM_PIECE, NOTE_PIECE, INDX_PIECE, TAIL_PIECE = (
    0,
    1,
    5,
    6,
    7,
    11,
    13,
    14,
)
"""Indices of pieces of `streams/journey`: CANO_PIECE holds frame 3, and FRAM_PIECE frame 4."""


Row = tuple[str, str, str, list[Piece], str]
"""Name, clauses, reject ids, pieces and description."""


def make_recovery(
    parent: ValidStream, pieces: list[Piece], piece_index: int, reject_ids: Sequence[str]
) -> Recovery:
    """Return the expected output if recovery resumes at the first CANO after a fault."""
    layout = assemble(pieces)
    resume_index = next(
        n for n in range(piece_index + 1, len(pieces)) if pieces[n].kind in (b"CANO", b"TAIL")
    )
    frames_before = count_frames(pieces[:piece_index])
    frames_lost = count_frames(pieces[piece_index + 1 : resume_index])
    frames_lost += count_frames(
        (parent.stream.pieces if len(pieces) == len(parent.stream.pieces) else pieces)[
            piece_index : piece_index + 1
        ]
    )
    start, end = layout.offsets[piece_index], layout.offsets[resume_index]
    frames = [*parent.frames[:frames_before], *parent.frames[frames_before + frames_lost :]]
    return Recovery(frames, (Gap(start, end - start, tuple(reject_ids), frames_lost),))


def count_frames(pieces: Iterable[Piece]) -> int:
    """Return the number of frames in pieces."""
    return sum(piece.kind in FRAME_TYPES for piece in pieces)


def make_faults_at(parent: ValidStream, piece_index: int, rows: Iterable[Row]) -> list[Vector]:
    """Return vectors with a fault in one piece of `streams/journey`, one for each row."""
    vectors = []
    for name, clauses, reject_ids, pieces, note in rows:
        reject_id_tuple = tuple(reject_ids.split())
        frames_before = count_frames(parent.stream.pieces[:piece_index])
        outcome = Outcome(parent.frames[:frames_before], reject_id_tuple)
        vector = make_broken_vector(parent, f"invalid/{name}", clauses, pieces, outcome, note)
        if piece_index >= CANO_PIECE:
            vector = replace(
                vector, recover=make_recovery(parent, pieces, piece_index, reject_id_tuple)
            )
        vectors.append(vector)
    return vectors


RECOVERY_CLAUSES = "1-3 11.4-1 11.4-2 11.4-3"


def make_damaged_vector(
    parent: ValidStream,
    name: str,
    clauses: str,
    data: bytes,
    outcome: Outcome,
    recovery: Recovery,
    note: str,
) -> Vector:
    """Return a patch of a valid stream, with the expected output without and with recovery."""
    return replace(make_broken_vector(parent, name, clauses, data, outcome, note), recover=recovery)


MOVED_FRAME = 4


def replace_frame_fields(parent: ValidStream, number: int, **fields: object) -> list[Piece]:
    """Return the pieces with changed fields in the payload of a frame."""
    return parent.stream.replace_frame_fields(number, **fields)
