"""invalid/: one fault in the fields of a payload, or in its sections (SPEC 5, 8)."""

import struct
from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import (
    CANO,
    FRAM,
    MOVED,
    Row,
    faults_at,
    with_fields,
)
from making.frames import Change, make_frame
from making.metadata_faults import make_metadata_faults
from making.payloads import Canonical, Frame
from making.streams import Piece
from making.vectors import Valid, Vector
from making.writing import Planes, WritingSection, encode, unsigned
from tests.spec import plain_planes

_HALF = 1 << 23


def make_payload_faults(parent: Valid) -> list[Vector]:
    """Return all of them, patches of the journey."""
    return [
        *faults_at(parent, FRAM, _of_frames(parent)),
        *faults_at(parent, FRAM, _of_words(parent)),
        *faults_at(parent, CANO, _of_canonicals(parent)),
        *faults_at(parent, CANO, _of_keys(parent)),
        *make_metadata_faults(parent),
    ]


def _cut(parent: Valid, place: int, change: int) -> list[Piece]:
    payload = parent.stream.pieces[place].payload or b""
    payload = payload[:change] if change < 0 else payload + bytes(change)
    return parent.stream.replaced(place, payload=payload)


def _of_frames(parent: Valid) -> Iterable[Row]:
    payload = parent.stream.pieces[FRAM].payload or b""
    frame = parent.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    many = struct.pack("<I", 0xFFFFFFFF)
    words = parent.stream.replaced(FRAM, payload=payload[:13] + many + payload[17:])
    one_more = struct.pack("<I", len(frame.motion) + len(frame.births) + 3)
    beyond = parent.stream.replaced(FRAM, payload=payload[:13] + one_more + payload[17:])
    count = parent.frames[MOVED - 1].gaussians
    yield (
        "frame-flag",
        "5-3",
        "field",
        with_fields(parent, MOVED, previous_contexts=2),
        "previous_contexts is 2",
    )
    yield (
        "frame-shorter",
        "5-1",
        "field",
        _cut(parent, FRAM, -1),
        "the last byte of FRAM is missing",
    )
    yield (
        "frame-empty",
        "5-1",
        "field",
        parent.stream.replaced(FRAM, payload=b""),
        "FRAM without fields",
    )
    yield (
        "frame-longer",
        "5-2",
        "trailing-data",
        _cut(parent, FRAM, 1),
        "a byte after the last field of FRAM",
    )
    yield "frame-words", "5-1 13-1", "field", words, "word_count is 2^32 - 1"
    yield (
        "frame-words-beyond",
        "5-1",
        "field",
        beyond,
        "the words of motion pass the end of the payload",
    )
    yield (
        "phase-repeated",
        "7.4-1",
        "frame-order",
        with_fields(parent, MOVED, phase=0),
        "a phase comes twice",
    )
    yield (
        "phase-skipped",
        "7.4-1",
        "frame-order",
        with_fields(parent, MOVED, phase=2),
        "a phase is left out",
    )
    yield (
        "phase-greatest",
        "7.4-1",
        "frame-order",
        with_fields(parent, MOVED, phase=0xFFFFFFFF),
        "a phase of 2^32 - 1",
    )
    yield (
        "deaths-of-all",
        "7.4-3",
        "count",
        with_fields(parent, MOVED, death_count=count),
        "all Gaussians die",
    )
    yield (
        "deaths-of-more",
        "7.4-3 3.2-5",
        "count",
        with_fields(parent, MOVED, death_count=0xFFFFFFFF),
        "more die than there are",
    )
    yield (
        "births-beyond-level",
        "3.2-3 3.2-5",
        "count-exceeds-level",
        with_fields(parent, MOVED, birth_count=4097),
        "a birth more than level 1.0 allows",
    )
    yield (
        "births-greatest",
        "3.2-3 3.2-5",
        "count-exceeds-level",
        with_fields(parent, MOVED, birth_count=0xFFFFFFFF),
        "2^32 - 1 births",
    )


def _of_words(parent: Valid) -> Iterable[Row]:
    """Sections that are no sections of an encoder."""
    frame = parent.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    words = tuple(frame.motion)
    stated = {
        "probability-240": ([1, *_bits(240)], "the first code that is none"),
        "probability-255": ([1, *_bits(255)], "a code of all ones"),
    }
    for name, (bits, note) in stated.items():
        coded = encode(zip(bits, [1 << 18] + [_HALF] * 8, strict=True))
        yield name, "8.2-1", "bad-probability", with_fields(parent, MOVED, motion=coded), note
    changed = {
        "words-end-in-zero": ((*words, 0), "invalid-words", "8.3-1", "a word of 0 after the last"),
        "words-zero": ((0,), "invalid-words", "8.3-1", "a section of one word, which is 0"),
        "words-left": ((7, *words), "unconsumed-words", "8.3-2 8.3-3", "a word before the first"),
        "words-left-zero": (
            (0, *words),
            "unconsumed-words",
            "8.3-3",
            "a word of 0 before the first",
        ),
    }
    for name, (said, ids, clauses, note) in changed.items():
        yield name, clauses, ids, with_fields(parent, MOVED, motion=said), note
    yield (
        "words-of-no-births",
        "8.3-2",
        "unconsumed-words",
        with_fields(parent, MOVED, births=(1,)),
        "a section without planes that has a word",
    )
    yield (
        "words-after-stillness",
        "8.3-2",
        "unconsumed-words",
        _still(parent),
        "words that say nothing moves, and leave a state",
    )


def _still(parent: Valid) -> list[Piece]:
    """All bits are 0, and the state after them is 1 less than none: what is left is not 0."""
    before = parent.stream.states[MOVED - 1]
    assert before is not None
    frame, _ = make_frame(parent.stream.head, before, Change())
    return parent.stream.replaced(FRAM, payload=replace(frame, motion=(1,)).pack())


def _bits(code: int) -> list[int]:
    return [code >> place & 1 for place in reversed(range(8))]


def _of_canonicals(parent: Valid) -> Iterable[Row]:
    payload = parent.stream.pieces[CANO].payload or b""
    many = parent.stream.replaced(CANO, payload=payload[:21] + b"\xff" * 4 + payload[25:])
    sections = parent.stream.payloads[3]
    assert isinstance(sections, Canonical)
    opacity = [*sections.sections[:2], (*sections.sections[2], 0), *sections.sections[3:]]
    left = [*sections.sections[:5], (1, *sections.sections[5])]
    yield (
        "canonical-axis-bits",
        "5-3",
        "field",
        with_fields(parent, 3, axis_bits=21),
        "axis_bits is 21",
    )
    yield (
        "canonical-shorter",
        "5-1",
        "field",
        _cut(parent, CANO, -1),
        "the last byte of CANO is missing",
    )
    yield (
        "canonical-empty",
        "5-1",
        "field",
        parent.stream.replaced(CANO, payload=payload[:4]),
        "CANO has an ordinal alone",
    )
    yield (
        "canonical-longer",
        "5-2",
        "trailing-data",
        _cut(parent, CANO, 4),
        "four bytes after the last field of CANO",
    )
    yield "canonical-words", "5-1 13-1", "field", many, "word_count is 2^32 - 1"
    yield (
        "canonical-repeated",
        "7.2-1",
        "frame-order",
        with_fields(parent, 3, frame=2),
        "an ordinal comes twice",
    )
    yield (
        "canonical-skipped",
        "7.2-1",
        "frame-order",
        with_fields(parent, 3, frame=4),
        "an ordinal is left out",
    )
    yield (
        "canonical-without-gaussians",
        "7.2-2",
        "count",
        with_fields(parent, 3, gaussian_count=0),
        "gaussian_count is 0",
    )
    yield (
        "gaussians-beyond-level",
        "3.2-1 3.2-5",
        "count-exceeds-level",
        with_fields(parent, 3, gaussian_count=65537),
        "a Gaussian more than level 1.0 allows",
    )
    yield (
        "gaussians-greatest",
        "3.2-1 3.2-5",
        "count-exceeds-level",
        with_fields(parent, 3, gaussian_count=0xFFFFFFFF),
        "2^32 - 1 Gaussians",
    )
    yield (
        "canonical-words-end-in-zero",
        "8.3-1",
        "invalid-words",
        with_fields(parent, 3, sections=opacity),
        "a word of 0 ends the opacities",
    )
    yield (
        "canonical-words-left",
        "8.3-3",
        "unconsumed-words",
        with_fields(parent, 3, sections=left),
        "a word before the first of SH rest",
    )


def _of_keys(parent: Valid) -> Iterable[Row]:
    canonical = parent.stream.payloads[3]
    assert isinstance(canonical, Canonical)
    least = canonical.axis_bits - 1
    yield (
        "keys-beyond-box",
        "8.5-1",
        "symbol-range",
        with_fields(parent, 3, axis_bits=least),
        "a position outside of its box",
    )
    yield (
        "keys-in-no-box",
        "8.5-1",
        "symbol-range",
        with_fields(parent, 3, axis_bits=0),
        "positions that differ in a box of one place",
    )
    for name, clauses, differences, note in _DIFFERENCES:
        section = _unsigned(differences + [0] * (canonical.gaussian_count - len(differences)))
        sections = [section, *canonical.sections[1:]]
        pieces = with_fields(parent, 3, sections=sections, axis_bits=20)
        yield name, clauses, "symbol-range", pieces, note


_DIFFERENCES: tuple[tuple[str, str, list[int], str], ...] = (
    ("difference-beyond", "8.4-1", [(1 << 60) + 1], "a difference of keys beyond 2^60"),
    ("difference-greatest", "8.4-1", [(1 << 63) - 1], "the greatest number that Unsigned(6) has"),
    (
        "difference-wraps",
        "8.4-1 4.1-1",
        [1 << 62] * 4,
        "differences of keys whose sum is 0 modulo 2^64",
    ),
    (
        "keys-add-up",
        "8.5-1",
        [1 << 59] * 3,
        "differences within their range whose sum is outside of the box",
    ),
    ("keys-first-outside", "8.5-1", [1 << 60], "the first key is 2^60"),
)


def _unsigned(values: list[int]) -> list[int]:
    """The words of a sequence by Unsigned(6), from counts of 0."""
    section = WritingSection("positions", Planes(unsigned(values, 6)), {})
    plain_planes.unsigned(section, "keys", [0] * len(values), 6)
    section.close()
    return section.written
