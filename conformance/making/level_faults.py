"""Makes vectors in invalid/ and damaged/: streams beyond the limits of levels 2.0 and 3.0."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from making.fault_rows import HEAD_CHUNK_INDEX, make_damaged_vector
from making.payloads import pack_chunk_header
from making.streams import Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector, make_patched_vector

_LIMITS = {20: (262144, 16384), 30: (1048576, 65536)}
_PAYLOAD_LIMIT_OF_30 = 1 << 26


def make_level_faults(brief: ValidStream) -> list[Vector]:
    """Return the vectors, made from `streams/brief`."""
    return [*_make_count_faults(brief), _make_long_chunk(brief)]


def _make_count_faults(brief: ValidStream) -> Iterable[Vector]:
    for level, (gaussians, births) in _LIMITS.items():
        rows: tuple[tuple[str, int, dict[str, Any], str], ...] = (
            ("gaussians", 0, {"gaussian_count": gaussians + 1}, "3.2-1"),
            ("births", 1, {"birth_count": births + 1}, "3.2-3"),
        )
        for name, frame_index, fields, clause in rows:
            chunks = brief.stream.replace_frame_fields(frame_index, **fields)
            chunks[HEAD_CHUNK_INDEX] = _make_head(brief, level)
            yield make_patched_vector(
                brief,
                f"invalid/{name}-beyond-level-{level}",
                f"{clause} 3.2-5",
                chunks,
                Outcome(brief.frames[:frame_index], ("count-exceeds-level",)),
                f"the number of {name} is one more than level {level} allows",
            )


def _make_long_chunk(brief: ValidStream) -> Vector:
    note = Chunk(b"note", b"")
    chunks = [_make_head(brief, 30), note, *brief.stream.chunks[1:]]
    data, offsets = (layout := assemble(chunks)).data, layout.offsets
    header = pack_chunk_header(note.kind, 1, _PAYLOAD_LIMIT_OF_30 + 1)
    gap = Gap(offsets[1], len(header), ("chunk-exceeds-level",), None)
    return make_damaged_vector(
        brief,
        "damaged/long-chunk-at-level-30",
        "3.2-4 11.4-2",
        data[: offsets[1]] + header + data[offsets[2] :],
        Outcome((), ("chunk-exceeds-level", "truncated")),
        Recovery(brief.frames, (gap,)),
        "the length of a chunk is one more than level 30 allows, and extends beyond the stream",
    )


def _make_head(brief: ValidStream, level: int) -> Chunk:
    return Chunk(b"HEAD", replace(brief.stream.head, level=level).pack())
