"""Compares a text with the package: constants, levels, reject ids, sections, syntax.

Each check takes the whole text and raises if text and package differ, so that `test_spec_mutations`
can apply it to wrong texts.
"""

import re
import zlib

from construct import Bytes, Const, Construct, Container, FormatField, Prefixed, Renamed

from plain import spec_text
from quarc_ref.decoder import philox
from quarc_ref.format import constants, errors, layouts

SYNTAX = (
    *("CHUNK_HEADER", "STREAM_HEADER", "CANONICAL", "FRAME", "FRAME_WITH_UPDATES", "SNAPSHOT"),
    *("CAMERAS", "CAMERA"),
    *("METADATA", "ENTRY", "TAIL", "INDEX", "SEEK_POINT", "SECTION"),
)
_FORMATS = {"<B": "u8", ">B": "u8", "<H": "u16", "<L": "u32", "<Q": "u64", "<l": "i32", "<f": "f32"}


def _list_leaves(kind: type) -> list[type]:
    subclasses = kind.__subclasses__()
    return (
        [leaf for subclass in subclasses for leaf in _list_leaves(subclass)]
        if subclasses
        else [kind]
    )


def check_constants(spec: str) -> None:
    spec_values = {name: float(value) for name, value, _ in spec_text.read_table(spec, "constants")}
    code_values = {
        name: float(value)
        for name, value in vars(constants).items()
        if name.isupper() and isinstance(value, int | float) and name != "UNLIMITED"
    }
    assert spec_values == code_values
    assert len(spec_values) == len(spec_text.read_table(spec, "constants"))


def check_sections_of_constants(spec: str) -> None:
    for name, _, meaning in spec_text.read_table(spec, "constants"):
        assert set(
            re.findall(r"section (\d+(?:\.\d+)?)", meaning)
        ) <= spec_text.list_section_numbers(spec), name


def check_levels(spec: str) -> None:
    spec_levels = {
        int(row[0]): tuple(map(int, row[1:])) for row in spec_text.read_table(spec, "levels")
    }
    assert spec_levels == {level: tuple(limits) for level, limits in constants.LEVELS.items()}


def check_rejects(spec: str) -> None:
    rows = spec_text.read_table(spec, "rejects")
    reject_ids = [row[0] for row in rows]
    assert sorted(reject_ids) == sorted(
        leaf.reject_id for leaf in _list_leaves(errors.BitstreamError)
    )
    for row in rows:
        assert set(re.findall(r"\d+(?:\.\d+)?", row[2])) <= spec_text.list_section_numbers(spec), (
            row
        )
        assert row[3] in {"refuse", "resume", "resume, skip"}, row
        assert row[4] == ("nothing" if row[0] in _AT_HEAD else "frames before"), row


def check_words(spec: str) -> None:
    for value in (constants.MAGIC, constants.SYNC):
        assert f"`{value.hex(' ').upper()}`" in spec, value


def check_version(spec: str) -> None:
    version = f"{constants.VERSION_MAJOR}.{constants.VERSION_MINOR}"
    assert spec.startswith(f"# The .quarc stream, version {version}\n")
    assert f"\n- {version}: " in spec


def check_formulas(spec: str) -> None:
    """Check the numbers in formulas that are not in a table."""
    ranks = spec_text.read_section(spec, "6.2")
    assert [int(word, 16) for word in re.findall(r"0x([0-9A-F]{8})", ranks)] == [
        *(int(multiplier) for multiplier in philox._MULTIPLIERS),
        *philox._KEY_STEPS,
    ]
    crc = re.findall(r"0x([0-9A-F]{8})", spec_text.read_section(spec, "4.5"))
    reflected = int(f"{int(crc[0], 16):032b}"[::-1], 2)
    assert [int(word, 16) for word in crc[1:]] == [
        *((1 << 32) - 1, zlib.crc32(b"123456789"), (1 << 32) - 1, reflected, (1 << 32) - 1),
    ]


def check_syntax(spec: str) -> None:
    for name in SYNTAX:
        layout = getattr(layouts, name)
        spec_rows = [(row[0], row[1]) for row in spec_text.read_table(spec, f"syntax {name}")]
        assert spec_rows == _rows(layout), name


def _rows(layout: Construct) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for field in layout.subcons:
        inner_layout = _unwrap(field)
        if field.name == "version":
            rows += _rows(inner_layout)
        elif hasattr(inner_layout, "parsebuildfrom"):
            count, items = (_unwrap(part) for part in inner_layout.subcons)
            rows += [("count", _describe(count)), (field.name, _repeat("count", items.subcon))]
        else:
            rows.append((field.name, _describe(inner_layout)))
    return rows


def _unwrap(layout: Construct) -> Construct:
    """Remove wrappers that add a name, a check or a computed value to a layout."""
    wrappers = ("Renamed", "Rebuild", "OneOf", "Validator", "ExprValidator")
    while isinstance(layout, Renamed) or type(layout).__name__ in wrappers:
        layout = layout.subcon
    return layout


def _describe(layout: Construct) -> str:
    """Return the type of a field in the notation of the tables."""
    layout = _unwrap(layout)
    if layout is layouts.SECTION:
        return "section"
    if isinstance(layout, FormatField):
        return _FORMATS[layout.fmtstr]
    if isinstance(layout, Bytes | Const):
        size = len(layout.value) if isinstance(layout, Const) else layout.length
        return f"{size} bytes" if isinstance(size, int) else _SIZE_DESCRIPTIONS[size(_COUNT_ONE)]
    if hasattr(layout, "count"):
        return _repeat(layout.count, layout.subcon)
    assert isinstance(layout.subcon, Prefixed), layout
    return {"u8": "text8", "u32": "text32"}[_describe(layout.subcon.lengthfield)]


def _repeat(count: int | str, layout: Construct) -> str:
    inner = _unwrap(layout)
    for name in SYNTAX:
        if inner is getattr(layouts, name):
            return f"{count} sections" if name == "SECTION" else f"{count} x {name}"
    return f"{count} x {_describe(inner)}"


_COUNT_ONE = Container(count=1, word_count=1)
_SIZE_DESCRIPTIONS = {4: "u32 each", layouts.SEEK_POINT.sizeof(): "count x SEEK_POINT"}
_AT_HEAD = ("bad-magic", "unsupported-version", "unsupported-feature")
CHECKS = (
    check_constants,
    check_sections_of_constants,
    check_levels,
    check_rejects,
    check_words,
    check_version,
    check_formulas,
    check_syntax,
)
