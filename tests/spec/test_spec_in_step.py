"""SPEC.md and the code say the same: whoever changes one changes the other."""

import re

import pytest
from construct import Bytes, BytesInteger, Const, Construct, FormatField, Renamed

from quarc_ref.format import constants, errors, wire
from tests.spec import spec_text

_TYPES = {("B", 1): "u8", ("H", 2): "u16", ("L", 4): "u32", ("Q", 8): "u64", ("f", 4): "f32"}


def _leaves(kind: type) -> list[type]:
    below = kind.__subclasses__()
    return [leaf for each in below for leaf in _leaves(each)] if below else [kind]


def test_the_constants_are_those_of_the_text():
    said = {name: float(value) for name, value, _ in spec_text.table("constants")}
    coded = {
        name: float(value)
        for name, value in vars(constants).items()
        if name.isupper() and isinstance(value, int | float) and name != "UNLIMITED"
    }

    assert said == coded


def test_the_levels_are_those_of_the_text():
    said = {int(row[0]): tuple(int(cell) for cell in row[1:]) for row in spec_text.table("levels")}

    assert said == {level: tuple(limits) for level, limits in constants.LEVELS.items()}


def test_the_reject_ids_are_those_of_the_text():
    said = [row[0] for row in spec_text.table("rejects")]

    assert sorted(said) == sorted(leaf.reject_id for leaf in _leaves(errors.BitstreamError))
    assert len(set(said)) == len(said)


def test_the_reject_ids_name_sections_that_exist():
    for row in spec_text.table("rejects"):
        assert set(re.findall(r"\d+(?:\.\d+)?", row[2])) <= spec_text.sections()


def test_every_section_that_the_code_names_exists():
    missing = {}
    for path in sorted((spec_text.ROOT / "quarc_ref").rglob("*.py")):
        wrong = set(spec_text.section_references(path.read_text("utf-8"))) - spec_text.sections()
        if wrong:
            missing[path.name] = wrong

    assert missing == {}


def test_the_magic_and_the_sync_word_are_those_of_the_text():
    for value in (constants.MAGIC, constants.SYNC):
        assert f"`{value.hex(' ').upper()}`" in spec_text.text()


def _describe(layout: Construct) -> str:
    """The type of a field, as the text's tables write it."""
    while isinstance(layout, Renamed) or (
        hasattr(layout, "subcon") and not hasattr(layout, "count") and layout is not wire.SECTION
    ):
        layout = layout.subcon
    if layout is wire.SECTION:
        return "section"
    if hasattr(layout, "count"):
        inner = _describe(layout.subcon)
        return f"{layout.count} {inner}s" if inner == "section" else f"{layout.count} x {inner}"
    if isinstance(layout, FormatField):
        name = _TYPES.get((layout.fmtstr[-1], layout.length))
        return name or {"l": "i32"}[layout.fmtstr[-1]]
    return "bytes" if isinstance(layout, Bytes | BytesInteger | Const) else "text"


def _rows(layout: Construct) -> list[tuple[str, str]]:
    rows = []
    for field in layout.subcons:
        if field.name == "version":
            rows += _rows(field.subcon)
        else:
            rows.append((field.name, _describe(field)))
    return rows


@pytest.mark.parametrize(
    "name",
    ["CHUNK_HEADER", "STREAM_HEADER", "CANONICAL", "FRAME", "CAMERA", "ENTRY", "TAIL", "SECTION"],
)
def test_a_syntax_table_has_the_fields_of_its_struct_in_their_order(name):
    said = [(row[0], _simple(row[1])) for row in spec_text.table(f"syntax {name}")]

    assert said == _rows(getattr(wire, name))


def _simple(written: str) -> str:
    """A type of the text without what construct does not tell: sizes of texts and byte strings."""
    written = re.sub(r"^\d+ bytes$|^u32 each$", "bytes", written)
    return "text" if written.startswith("text") else written


def test_the_sizes_of_the_fixed_parts_are_those_of_the_text():
    assert wire.CHUNK_HEADER.sizeof() == constants.CHUNK_HEADER_BYTES
    assert wire.SECTION.build({"table": b"", "word_count": 0, "words": b""}) == bytes(
        constants.SECTION_HEADER_BYTES
    )


@pytest.mark.parametrize(
    ("field", "least", "most"),
    [
        (row[0], *re.findall(r"\d+", row[2])[:2])
        for row in spec_text.table("syntax STREAM_HEADER")
        if re.fullmatch(r"\d+ to \d+", row[2]) and row[0] != "right_handed"
    ],
)
def test_the_ranges_of_the_header_are_those_of_the_text(field, least, most):
    from quarc_ref.format.records import _HEADER_RANGES

    assert _HEADER_RANGES[field] == (int(least), int(most))
