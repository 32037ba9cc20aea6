"""invalid/: one fault in the fields of a payload (SPEC 5.4, 5.5, 7.2, 7.4)."""

import struct
from collections.abc import Iterable
from typing import Any

from making.fault_rows import CANO, FRAM, MOVED, Row, faults_at, with_fields
from making.metadata_faults import make_metadata_faults
from making.payloads import Canonical, Frame
from making.streams import Piece
from making.vectors import Valid, Vector
from making.word_faults import keys_at_fault, words_at_fault

_MAXIMUM = (1 << 32) - 1
Field = tuple[str, str, str, dict[str, Any], str]
"""Name, clauses, reject id, changed fields, and description."""

_FRAME_FIELDS: tuple[Field, ...] = (
    ("phase-repeated", "7.4-1", "frame-order", {"phase": 0}, "a phase is repeated"),
    ("phase-skipped", "7.4-1", "frame-order", {"phase": 2}, "a phase is skipped"),
    ("phase-greatest", "7.4-1", "frame-order", {"phase": _MAXIMUM}, "a phase of 2^32 - 1"),
)
_FRAME_COUNTS: tuple[Field, ...] = (
    (
        "deaths-of-more",
        "7.4-3 3.2-5",
        "count",
        {"death_count": _MAXIMUM},
        "more deaths than Gaussians",
    ),
    (
        *("births-beyond-level", "3.2-3 3.2-5", "count-exceeds-level", {"birth_count": 4097}),
        "one birth more than level 1.0 allows",
    ),
    (
        *("births-greatest", "3.2-3 3.2-5", "count-exceeds-level", {"birth_count": _MAXIMUM}),
        "2^32 - 1 births",
    ),
)
_CANONICAL_FIELDS: tuple[Field, ...] = (
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
        *("gaussians-greatest", "3.2-1 3.2-5", "count-exceeds-level", {"gaussian_count": _MAXIMUM}),
        "2^32 - 1 Gaussians",
    ),
)


def make_payload_faults(parent: Valid) -> list[Vector]:
    """Return all vectors, as patches of the journey."""
    return [
        *faults_at(parent, FRAM, _of_frames(parent)),
        *faults_at(parent, FRAM, words_at_fault(parent)),
        *faults_at(parent, CANO, _of_canonicals(parent)),
        *faults_at(parent, CANO, keys_at_fault(parent)),
        *make_metadata_faults(parent),
    ]


def _of_frames(parent: Valid) -> Iterable[Row]:
    frame, place = parent.stream.payloads[MOVED], FRAM
    assert isinstance(frame, Frame)
    payload, more = frame.pack(), len(frame.motion) + len(frame.births) + 3
    flag = with_fields(parent, MOVED, previous_contexts=2)
    yield "frame-flag", "5-3", "field", flag, "previous_contexts is 2"
    yield from _of_sizes(parent, place, "frame", 0, 1)
    words = _put(parent, place, payload, 13, _MAXIMUM)
    yield "frame-words", "5-1 13-1", "field", words, "word_count is 2^32 - 1"
    words, note = _put(parent, place, payload, 13, more), "words that extend beyond the payload"
    yield "frame-words-beyond", "5-1", "field", words, note
    yield from _each_field(parent, MOVED, _FRAME_FIELDS)
    alive = parent.frames[MOVED - 1].gaussians
    everyone = with_fields(parent, MOVED, death_count=alive)
    yield "deaths-of-all", "7.4-3", "count", everyone, "all Gaussians die"
    yield from _each_field(parent, MOVED, _FRAME_COUNTS)


def _of_canonicals(parent: Valid) -> Iterable[Row]:
    canonical, place = parent.stream.payloads[3], CANO
    assert isinstance(canonical, Canonical)
    wide = with_fields(parent, 3, axis_bits=21)
    yield "canonical-axis-bits", "5-3", "field", wide, "axis_bits is 21"
    yield from _of_sizes(parent, place, "canonical", 4, 4)
    words = _put(parent, place, canonical.pack(), 21, _MAXIMUM)
    yield "canonical-words", "5-1 13-1", "field", words, "word_count is 2^32 - 1"
    yield from _each_field(parent, 3, _CANONICAL_FIELDS)
    first, rest = list(canonical.sections), list(canonical.sections)
    first[2], rest[5] = (*first[2], 0), (1, *rest[5])
    pieces, note = with_fields(parent, 3, sections=first), "a word of 0 ends the opacities"
    yield "canonical-words-end-in-zero", "8.3-1", "invalid-words", pieces, note
    pieces, note = with_fields(parent, 3, sections=rest), "a word before the first of SH rest"
    yield "canonical-words-left", "8.3-3", "unconsumed-words", pieces, note


def _of_sizes(parent: Valid, place: int, name: str, few: int, more: int) -> Iterable[Row]:
    """A payload with a few bytes too many or too few."""
    payload = parent.stream.pieces[place].payload or b""
    kind = parent.stream.pieces[place].kind.decode()
    sizes = {
        "shorter": (payload[:-1], "5-1", "field", f"the last byte of {kind} is missing"),
        "empty": (payload[:few], "5-1", "field", f"{kind} of {few} bytes"),
        "longer": (payload + bytes(more), "5-2", "trailing-data", f"{more} bytes after {kind}"),
    }
    for what, (changed, clauses, ids, note) in sizes.items():
        pieces = parent.stream.replaced(place, payload=changed)
        yield f"{name}-{what}", clauses, ids, pieces, note


def _put(parent: Valid, place: int, payload: bytes, at: int, number: int) -> list[Piece]:
    changed = payload[:at] + struct.pack("<I", number) + payload[at + 4 :]
    return parent.stream.replaced(place, payload=changed)


def _each_field(parent: Valid, number: int, fields: Iterable[Field]) -> Iterable[Row]:
    for name, clauses, ids, said, note in fields:
        yield name, clauses, ids, with_fields(parent, number, **said), note
