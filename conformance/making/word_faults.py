"""invalid/: sections that no encoder writes (SPEC 8)."""

from collections.abc import Iterable
from dataclasses import replace

from making.changes import Change
from making.fault_rows import FRAM, MOVED, Row, with_fields
from making.frames import make_frame
from making.payloads import Canonical, Frame
from making.streams import Piece
from making.vectors import Valid
from making.writing import Planes, WritingSection, encode, unsigned
from plain import planes

_HALF, _STATED = 1 << 23, 1 << 18
_DIFFERENCES: tuple[tuple[str, str, list[int], str], ...] = (
    ("difference-beyond", "8.4-1", [(1 << 60) + 1], "a difference of keys beyond 2^60"),
    ("difference-greatest", "8.4-1", [(1 << 63) - 1], "the largest number of Unsigned(6)"),
    ("difference-wraps", "8.4-1 4.1-1", [1 << 62] * 4, "differences with a sum of 0 modulo 2^64"),
    ("keys-add-up", "8.5-1", [1 << 59] * 3, "differences of which only the sum is outside the box"),
    ("keys-first-outside", "8.5-1", [1 << 60], "the first key is 2^60"),
)


def words_at_fault(parent: Valid) -> Iterable[Row]:
    """Yield frames whose motion or births are sections that no encoder writes."""
    frame = parent.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    for code, note in ((240, "the first undefined code"), (255, "a code of all ones")):
        pieces = with_fields(parent, MOVED, motion=state_code(code))
        yield f"probability-{code}", "8.2-1", "bad-probability", pieces, note
    words, left = tuple(frame.motion), "unconsumed-words"
    changed = {
        "words-end-in-zero": ((*words, 0), "invalid-words", "8.3-1", "a word of 0 after the last"),
        "words-zero": ((0,), "invalid-words", "8.3-1", "a section of one word, which is 0"),
        "words-left": ((7, *words), left, "8.3-2 8.3-3", "a word before the first"),
        "words-left-zero": ((0, *words), left, "8.3-3", "a word of 0 before the first"),
    }
    for name, (said, ids, clauses, note) in changed.items():
        yield name, clauses, ids, with_fields(parent, MOVED, motion=said), note
    no_births, note = with_fields(parent, MOVED, births=(1,)), "a word in a section without planes"
    yield "words-of-no-births", "8.3-2", left, no_births, note
    note = "words without motion that leave a state"
    yield "words-after-stillness", "8.3-2", left, _still(parent), note


def keys_at_fault(parent: Valid) -> Iterable[Row]:
    """Yield canonical frames whose keys are outside their box."""
    canonical = parent.stream.payloads[3]
    assert isinstance(canonical, Canonical)
    boxes = {
        "keys-beyond-box": (canonical.axis_bits - 1, "a position outside its box"),
        "keys-in-no-box": (0, "different positions in a box of one position"),
    }
    for name, (bits, note) in boxes.items():
        yield name, "8.5-1", "symbol-range", with_fields(parent, 3, axis_bits=bits), note
    for name, clauses, differences, note in _DIFFERENCES:
        section = _code(differences + [0] * (canonical.gaussian_count - len(differences)))
        sections = [section, *canonical.sections[1:]]
        pieces = with_fields(parent, 3, sections=sections, axis_bits=20)
        yield name, clauses, "symbol-range", pieces, note


def _still(parent: Valid) -> list[Piece]:
    """All bits are 0, but the state after them is not."""
    before = parent.stream.states[MOVED - 1]
    assert before is not None
    frame, _ = make_frame(parent.stream.head, before, Change())
    return parent.stream.replaced(FRAM, payload=replace(frame, motion=(1,)).pack())


def state_code(code: int) -> list[int]:
    """Return the words of a first plane with one context and a stated probability."""
    bits = [1, *(code >> place & 1 for place in reversed(range(8)))]
    return encode(zip(bits, [_STATED] + [_HALF] * 8, strict=True))


def _code(values: list[int]) -> list[int]:
    """The words of a sequence by Unsigned(6), with counts of 0 at the start."""
    section = WritingSection("positions", Planes(unsigned(values, 6)), {})
    planes.unsigned(section, "keys", [0] * len(values), 6)
    section.close()
    return section.written
