"""Makes vectors in invalid/ with one fault in a payload field (SPEC 5.4, 5.5, 7.2, 7.4)."""

import struct
from collections.abc import Iterable
from typing import Any

from making.fault_rows import (
    CANO_CHUNK_INDEX,
    FRAM_CHUNK_INDEX,
    FRAM_ORDINAL,
    FaultRow,
    make_faults_at,
    replace_frame_fields,
)
from making.metadata_faults import make_metadata_faults
from making.payloads import Canonical, Frame
from making.streams import Chunk
from making.vectors import ValidStream, Vector
from making.word_faults import list_key_faults, list_word_faults

_MAX_U32 = (1 << 32) - 1
FieldFault = tuple[str, str, str, dict[str, Any], str]
"""Name, clauses, reject id, changed fields, and description."""

_FRAME_FIELDS: tuple[FieldFault, ...] = (
    ("phase-repeated", "7.4-1", "frame-order", {"phase": 0}, "a phase is repeated"),
    ("phase-skipped", "7.4-1", "frame-order", {"phase": 2}, "a phase is skipped"),
    ("phase-greatest", "7.4-1", "frame-order", {"phase": _MAX_U32}, "the phase is 2^32 - 1"),
)
_FRAME_COUNTS: tuple[FieldFault, ...] = (
    (
        "deaths-of-more",
        "7.4-3 3.2-5",
        "count",
        {"death_count": _MAX_U32},
        "death_count is larger than the number of Gaussians",
    ),
    (
        *("births-beyond-level", "3.2-3 3.2-5", "count-exceeds-level", {"birth_count": 4097}),
        "one birth more than level 1.0 allows",
    ),
    (
        *("births-greatest", "3.2-3 3.2-5", "count-exceeds-level", {"birth_count": _MAX_U32}),
        "2^32 - 1 births",
    ),
)
_CANONICAL_FIELDS: tuple[FieldFault, ...] = (
    ("canonical-repeated", "7.2-1", "frame-order", {"frame": 2}, "an ordinal is repeated"),
    ("canonical-skipped", "7.2-1", "frame-order", {"frame": 4}, "an ordinal is skipped"),
    (
        *("canonical-without-gaussians", "7.2-2", "count", {"gaussian_count": 0}),
        "gaussian_count is 0",
    ),
    (
        *("gaussians-beyond-level", "3.2-1 3.2-5", "count-exceeds-level"),
        *({"gaussian_count": 65537}, "one Gaussian more than level 1.0 allows"),
    ),
    (
        *("gaussians-greatest", "3.2-1 3.2-5", "count-exceeds-level", {"gaussian_count": _MAX_U32}),
        "2^32 - 1 Gaussians",
    ),
)


def make_payload_faults(parent: ValidStream) -> list[Vector]:
    """Return the vectors of this module, as patches of `streams/journey`."""
    return [
        *make_faults_at(parent, FRAM_CHUNK_INDEX, _list_frame_faults(parent)),
        *make_faults_at(parent, FRAM_CHUNK_INDEX, list_word_faults(parent)),
        *make_faults_at(parent, CANO_CHUNK_INDEX, _list_canonical_faults(parent)),
        *make_faults_at(parent, CANO_CHUNK_INDEX, list_key_faults(parent)),
        *make_metadata_faults(parent),
    ]


def _list_frame_faults(parent: ValidStream) -> Iterable[FaultRow]:
    frame, chunk_index = parent.stream.frame_payloads[FRAM_ORDINAL], FRAM_CHUNK_INDEX
    assert isinstance(frame, Frame)
    payload, too_many_words = frame.pack(), len(frame.motion) + len(frame.births) + 3
    with_wrong_flag = replace_frame_fields(parent, FRAM_ORDINAL, previous_contexts=2)
    yield "frame-flag", "5-3", "field", with_wrong_flag, "previous_contexts is 2"
    yield from _list_size_faults(parent, chunk_index, "frame", 0, 1)
    with_wrong_count = _replace_u32(parent, chunk_index, payload, 13, _MAX_U32)
    yield "frame-words", "5-1 13-1", "field", with_wrong_count, "word_count is 2^32 - 1"
    with_wrong_count, note = (
        _replace_u32(parent, chunk_index, payload, 13, too_many_words),
        "the words of a section extend beyond the payload",
    )
    yield "frame-words-beyond", "5-1", "field", with_wrong_count, note
    with_wrong_count, note = (
        _replace_u32(parent, chunk_index, payload, 17 + 4 * len(frame.motion), 1 << 30),
        "word_count of births is 2^30, whose size is 0 bytes in 32 bits",
    )
    yield "frame-words-wrap", "5-1", "field", with_wrong_count, note
    yield from _list_field_faults(parent, FRAM_ORDINAL, _FRAME_FIELDS)
    gaussian_count = parent.frames[FRAM_ORDINAL - 1].gaussians
    with_all_deaths = replace_frame_fields(parent, FRAM_ORDINAL, death_count=gaussian_count)
    yield "deaths-of-all", "7.4-3", "count", with_all_deaths, "all Gaussians die"
    yield from _list_field_faults(parent, FRAM_ORDINAL, _FRAME_COUNTS)


def _list_canonical_faults(parent: ValidStream) -> Iterable[FaultRow]:
    canonical, chunk_index = parent.stream.frame_payloads[3], CANO_CHUNK_INDEX
    assert isinstance(canonical, Canonical)
    with_wide_axis = replace_frame_fields(parent, 3, axis_bits=21)
    yield "canonical-axis-bits", "5-3", "field", with_wide_axis, "axis_bits is 21"
    yield from _list_size_faults(parent, chunk_index, "canonical", 4, 4)
    with_wrong_count = _replace_u32(parent, chunk_index, canonical.pack(), 21, _MAX_U32)
    yield "canonical-words", "5-1 13-1", "field", with_wrong_count, "word_count is 2^32 - 1"
    yield from _list_field_faults(parent, 3, _CANONICAL_FIELDS)
    opacity_sections, sh_rest_sections = list(canonical.sections), list(canonical.sections)
    opacity_sections[2], sh_rest_sections[5] = (*opacity_sections[2], 0), (1, *sh_rest_sections[5])
    chunks, note = (
        replace_frame_fields(parent, 3, sections=opacity_sections),
        "the opacity section ends with a zero word",
    )
    yield "canonical-words-end-in-zero", "8.3-1", "invalid-words", chunks, note
    chunks, note = (
        replace_frame_fields(parent, 3, sections=sh_rest_sections),
        "an extra word before the first word of the SH rest section",
    )
    yield "canonical-words-left", "8.3-3", "unconsumed-words", chunks, note


def _list_size_faults(
    parent: ValidStream, chunk_index: int, name: str, empty_size: int, extra_bytes: int
) -> Iterable[FaultRow]:
    """Yield streams in which a payload lacks its last byte, has only a few bytes or is too long."""
    payload = parent.stream.chunks[chunk_index].payload or b""
    kind = parent.stream.chunks[chunk_index].kind.decode()
    size_cases = {
        "shorter": (payload[:-1], "5-1", "field", f"the last byte of {kind} is missing"),
        "empty": (
            payload[:empty_size],
            "5-1",
            "field",
            f"the payload of {kind} has {empty_size} bytes",
        ),
        "longer": (
            payload + bytes(extra_bytes),
            "5-2",
            "trailing-data",
            f"additional bytes at the end of {kind}: {extra_bytes}",
        ),
    }
    for suffix, (changed_payload, clauses, reject_ids, note) in size_cases.items():
        chunks = parent.stream.replace_chunk(chunk_index, payload=changed_payload)
        yield f"{name}-{suffix}", clauses, reject_ids, chunks, note


def _replace_u32(
    parent: ValidStream, chunk_index: int, payload: bytes, offset: int, value: int
) -> list[Chunk]:
    changed_payload = payload[:offset] + struct.pack("<I", value) + payload[offset + 4 :]
    return parent.stream.replace_chunk(chunk_index, payload=changed_payload)


def _list_field_faults(
    parent: ValidStream, frame_index: int, field_faults: Iterable[FieldFault]
) -> Iterable[FaultRow]:
    for name, clauses, reject_ids, changed_fields, note in field_faults:
        yield (
            name,
            clauses,
            reject_ids,
            replace_frame_fields(parent, frame_index, **changed_fields),
            note,
        )
