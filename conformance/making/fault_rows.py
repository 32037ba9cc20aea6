"""Makes vectors with their expected output from rows that describe faults in `streams/journey`."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from making.streams import FRAME_TYPES, Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector, make_patched_vector

(
    HEAD_CHUNK_INDEX,
    CAME_CHUNK_INDEX,
    CANO_CHUNK_INDEX,
    META_CHUNK_INDEX,
    FRAM_CHUNK_INDEX,
    NOTE_CHUNK_INDEX,
    INDX_CHUNK_INDEX,
    TAIL_CHUNK_INDEX,
) = (
    0,
    1,
    5,
    6,
    7,
    11,
    13,
    14,
)
"""Indices of chunks of `streams/journey`; CANO and FRAM are the chunks of frames 3 and 4."""


FaultRow = tuple[str, str, str, list[Chunk], str]
"""Name, clauses, reject ids, chunks and description."""


def make_recovery(
    parent: ValidStream, chunks: list[Chunk], chunk_index: int, reject_ids: Sequence[str]
) -> Recovery:
    """Return the expected output if recovery resumes at the first CANO or TAIL after a fault."""
    layout = assemble(chunks)
    resume_index = next(
        n for n in range(chunk_index + 1, len(chunks)) if chunks[n].kind in (b"CANO", b"TAIL")
    )
    frames_before = count_frames(chunks[:chunk_index])
    frames_lost = count_frames(chunks[chunk_index + 1 : resume_index])
    frames_lost += count_frames(
        (parent.stream.chunks if len(chunks) == len(parent.stream.chunks) else chunks)[
            chunk_index : chunk_index + 1
        ]
    )
    start, end = layout.offsets[chunk_index], layout.offsets[resume_index]
    frames = [*parent.frames[:frames_before], *parent.frames[frames_before + frames_lost :]]
    return Recovery(frames, (Gap(start, end - start, tuple(reject_ids), frames_lost),))


def count_frames(chunks: Iterable[Chunk]) -> int:
    """Return the number of chunks that contain a frame."""
    return sum(chunk.kind in FRAME_TYPES for chunk in chunks)


def make_faults_at(parent: ValidStream, chunk_index: int, rows: Iterable[FaultRow]) -> list[Vector]:
    """Return one vector for each row, with a fault in the given chunk of `streams/journey`."""
    vectors = []
    for name, clauses, reject_ids, chunks, note in rows:
        reject_id_tuple = tuple(reject_ids.split())
        frames_before = count_frames(parent.stream.chunks[:chunk_index])
        outcome = Outcome(parent.frames[:frames_before], reject_id_tuple)
        vector = make_patched_vector(parent, f"invalid/{name}", clauses, chunks, outcome, note)
        if chunk_index >= CANO_CHUNK_INDEX:
            vector = replace(
                vector, recover=make_recovery(parent, chunks, chunk_index, reject_id_tuple)
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
    """Return a patched copy of a valid stream, with its output with and without recovery."""
    return replace(
        make_patched_vector(parent, name, clauses, data, outcome, note), recover=recovery
    )


FRAM_ORDINAL = 4
"""Ordinal of the frame in the chunk at `FRAM_CHUNK_INDEX`."""


def replace_frame_fields(parent: ValidStream, frame_index: int, **fields: object) -> list[Chunk]:
    """Return the chunks of the parent, with some fields of a frame's payload replaced."""
    return parent.stream.replace_frame_fields(frame_index, **fields)
