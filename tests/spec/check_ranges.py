"""Compares the `range` column of SPEC 5 with the values that the package accepts and rejects.

A payload is packed with the table of the text. One field is at an end of its range, or just
outside the range.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial

import numpy as np

from plain import spec_text
from quarc_ref.format import constants, wire
from quarc_ref.format.errors import FieldError
from quarc_ref.format.records import StreamHeader
from tests.small_streams import CAMERA

_STRUCT_FORMATS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i32": "i", "f32": "f"}
_MAXIMUMS = {"u8": (1 << 8) - 1, "u16": (1 << 16) - 1, "u32": (1 << 32) - 1, "u64": (1 << 64) - 1}
_SMALLEST_FLOAT = float(np.finfo(np.float32).smallest_subnormal)
_NON_FINITE = (float("nan"), float("inf"), -float("inf"))
_VERSION = {
    "version_major": constants.VERSION_MAJOR,
    "version_minor": constants.VERSION_MINOR,
    "incompatible_features": 0,
    "compatible_features": 0,
}
_EMPTY_FRAME = {"origin": (0, 0, 0), "frame": 0, "phase": 1}
Values = dict[str, object]
Cases = tuple[list[float], list[float]]

_PAYLOADS: dict[str, tuple[Values, Callable[[bytes], object], bytes]] = {
    "STREAM_HEADER": ({**_VERSION, **asdict(StreamHeader())}, wire.parse_stream_header, b""),
    "CANONICAL": (_EMPTY_FRAME, wire.parse_canonical, b""),
    "FRAME": (_EMPTY_FRAME, wire.parse_frame, b""),
    "FRAME_WITH_UPDATES": (_EMPTY_FRAME, partial(wire.parse_frame, updates=True), b""),
    "SNAPSHOT": (_EMPTY_FRAME, wire.parse_snapshot, b""),
    "CAMERA": (asdict(CAMERA), wire.parse_cameras, b"\x01\x00"),
}


def check_ranges(spec: str) -> None:
    for marker, (values, parse, prefix) in _PAYLOADS.items():
        rows = spec_text.read_records(spec, f"syntax {marker}")
        for row in rows:
            if row["field"] in _VERSION:
                continue
            for is_valid, value in _cases(spec, row):
                payload = prefix + _pack(rows, {**values, row["field"]: value})
                assert _accepts(parse, payload) == is_valid, (marker, row["field"], value)


def _accepts(parse: Callable[[bytes], object], payload: bytes) -> bool:
    try:
        parse(payload)
    except FieldError:
        return False
    return True


def _cases(spec: str, row: dict[str, str]) -> Iterator[tuple[bool, object]]:
    field_type = row["type"]
    count, _, item_type = field_type.rpartition(" x ")
    if item_type not in _STRUCT_FORMATS:
        return
    valid_values, invalid_values = _edges(spec, row["range"], item_type)
    for is_valid, values in ((True, valid_values), (False, invalid_values)):
        for value in values:
            yield is_valid, (value,) * int(count) if count else value


def _edges(spec: str, range_text: str, kind: str) -> Cases:
    """Return the outermost values inside a range, and the nearest values outside."""
    words = range_text.split()
    type_maximum = _MAXIMUMS.get(kind, (1 << 31) - 1)
    if kind == "f32":
        return _float_edges(words)
    if not words:
        return [0, type_maximum], []
    if words[0] == "of":
        levels = [int(row[0]) for row in spec_text.read_table(spec, "levels")]
        return levels, [level for level in range(256) if level not in levels]
    minimum = int(words[1] if words[0] == ">=" else words[0])
    maximum = type_maximum if words[0] == ">=" else int(words[2])
    return [minimum, maximum], [
        value for value in (minimum - 1, maximum + 1) if 0 <= value <= type_maximum
    ]


def _float_edges(words: list[str]) -> Cases:
    if words == ["finite"]:
        return [0.0, -1e30], list(_NON_FINITE)
    if words == [">", "0"]:
        return [_SMALLEST_FLOAT, 1e30], [0.0, -_SMALLEST_FLOAT, *_NON_FINITE]
    minimum, lower_operator, variable, upper_operator, maximum = words
    assert (float(minimum), variable, upper_operator) == (0.0, "x", "<=")
    above_maximum = float(np.nextafter(np.float32(maximum), np.float32(np.inf)))
    if lower_operator == "<=":
        return [0.0, -0.0, float(maximum)], [-_SMALLEST_FLOAT, above_maximum, *_NON_FINITE]
    assert lower_operator == "<"
    return [_SMALLEST_FLOAT, float(maximum)], [0.0, -_SMALLEST_FLOAT, above_maximum, *_NON_FINITE]


def _pack(rows: list[dict[str, str]], values: Values) -> bytes:
    packed = b""
    for row in rows:
        kind, value = row["type"], values.get(row["field"], 0)
        if kind == "text8":
            packed += bytes([len(str(value))]) + str(value).encode()
        elif kind.endswith(("section", "sections")):
            count = 1 if kind == "section" else int(kind.split()[0])
            packed += bytes(constants.SECTION_HEADER_BYTES) * count
        else:
            numbers = value if isinstance(value, tuple) else (value,)
            packed += struct.pack(
                f"<{len(numbers)}{_STRUCT_FORMATS[kind.rpartition(' x ')[2]]}", *numbers
            )
    return packed


CHECKS = (check_ranges,)
