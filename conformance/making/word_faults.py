"""Makes vectors in invalid/: sections whose words or integers violate a clause (SPEC 8)."""

from collections.abc import Iterable
from dataclasses import replace

from making.changes import Change
from making.fault_rows import FRAM_CHUNK_INDEX, FRAM_ORDINAL, FaultRow, replace_frame_fields
from making.frames import make_frame
from making.payloads import Canonical, Frame
from making.streams import Chunk
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector
from making.writing import Planes, WritingSection, encode, make_unsigned_planes
from plain import planes

_HALF_WEIGHT, _STATED_WEIGHT = 1 << 23, 1 << 18
_WRONG_KEY_DIFFERENCES: tuple[tuple[str, str, list[int], str], ...] = (
    ("difference-beyond", "8.4-1", [(1 << 60) + 1], "a difference of Morton keys above 2^60"),
    (
        "difference-greatest",
        "8.4-1",
        [(1 << 63) - 1],
        "the largest difference of keys that Unsigned(6) can code",
    ),
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
        "each difference of keys is inside the box, but their sum is outside",
    ),
    ("keys-first-outside", "8.5-1", [1 << 60], "the first Morton key is 2^60"),
)


def list_word_faults(parent: ValidStream) -> Iterable[FaultRow]:
    """Yield frames with wrong words in the section of motion or births."""
    frame = parent.stream.frame_payloads[FRAM_ORDINAL]
    assert isinstance(frame, Frame)
    for code, note in (
        (240, "a stated probability code of 240, the first undefined one"),
        (255, "a stated probability code of 255"),
    ):
        chunks = replace_frame_fields(parent, FRAM_ORDINAL, motion=encode_stated_code(code))
        yield f"probability-{code}", "8.2-1", "bad-probability", chunks, note
    words, unconsumed_id = tuple(frame.motion), "unconsumed-words"
    word_cases = {
        "words-end-in-zero": (
            (*words, 0),
            "invalid-words",
            "8.3-1",
            "an extra zero word after the last word of the motion section",
        ),
        "words-zero": ((0,), "invalid-words", "8.3-1", "the only word of the motion section is 0"),
        "words-left": (
            (7, *words),
            unconsumed_id,
            "8.3-2 8.3-3",
            "an extra word before the first word of the motion section",
        ),
        "words-left-zero": (
            (0, *words),
            unconsumed_id,
            "8.3-3",
            "an extra zero word before the first word of the motion section",
        ),
    }
    for name, (motion_words, reject_id, clauses, note) in word_cases.items():
        yield (
            name,
            clauses,
            reject_id,
            replace_frame_fields(parent, FRAM_ORDINAL, motion=motion_words),
            note,
        )
    with_birth_words, note = (
        replace_frame_fields(parent, FRAM_ORDINAL, births=(1,)),
        "a births section with one word in a frame without births",
    )
    yield "words-of-no-births", "8.3-2", unconsumed_id, with_birth_words, note
    note = "motion words that code only zeros but leave a nonzero coder state"
    yield "words-after-stillness", "8.3-2", unconsumed_id, _replace_motion_words(parent), note


def list_key_faults(parent: ValidStream) -> Iterable[FaultRow]:
    """Yield canonical frames with Morton keys outside their box."""
    canonical = parent.stream.frame_payloads[3]
    assert isinstance(canonical, Canonical)
    boxes = {
        "keys-beyond-box": (canonical.axis_bits - 1, "a position outside its box"),
        "keys-in-no-box": (0, "several positions in a box that has room for only one"),
    }
    for name, (bits, note) in boxes.items():
        yield name, "8.5-1", "symbol-range", replace_frame_fields(parent, 3, axis_bits=bits), note
    for name, clauses, differences, note in _WRONG_KEY_DIFFERENCES:
        section = _encode_keys(differences + [0] * (canonical.gaussian_count - len(differences)))
        sections = [section, *canonical.sections[1:]]
        chunks = replace_frame_fields(parent, 3, sections=sections, axis_bits=20)
        yield name, clauses, "symbol-range", chunks, note


def make_wrapping_keys(parent: ValidStream) -> Vector:
    """Return a canonical frame whose keys are beyond every box; the last one is 0 modulo 2^64."""
    canonical = parent.stream.frame_payloads[0]
    assert isinstance(canonical, Canonical)
    differences = [1 << 60] * 16 + [0] * (canonical.gaussian_count - 16)
    sections = [_encode_keys(differences), *canonical.sections[1:]]
    return make_patched_vector(
        parent,
        "invalid/keys-wrap",
        "8.5-1 4.1-1",
        replace_frame_fields(parent, 0, sections=sections, axis_bits=20),
        Outcome((), ("symbol-range",)),
        "keys whose differences are allowed, but whose sum is 0 modulo 2^64",
    )


def _replace_motion_words(parent: ValidStream) -> list[Chunk]:
    """Return chunks with motion words that code only zeros but leave a nonzero coder state."""
    previous = parent.stream.states[FRAM_ORDINAL - 1]
    assert previous is not None
    frame, _ = make_frame(parent.stream.head, previous, Change())
    return parent.stream.replace_chunk(FRAM_CHUNK_INDEX, payload=replace(frame, motion=(1,)).pack())


def encode_stated_code(code: int) -> list[int]:
    """Return words that state a probability code for the only context of the first plane."""
    bits = [1, *(code >> place & 1 for place in reversed(range(8)))]
    return encode(zip(bits, [_STATED_WEIGHT] + [_HALF_WEIGHT] * 8, strict=True))


def _encode_keys(values: list[int]) -> list[int]:
    """Return the words that code values by Unsigned(6), with counts that start at 0."""
    section = WritingSection("positions", Planes(make_unsigned_planes(values, 6)), {})
    planes.read_unsigned(section, "keys", [0] * len(values), 6)
    section.close()
    return section.written_words
