"""Parses a stream by the syntax tables of SPEC 5, which are read from its text.

The code contains no layout, so a wrong row in the text gives wrong fields.
"""

import re
import struct
import zlib
from dataclasses import dataclass
from typing import Any

from plain import spec_text

_INTEGERS = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q", "i32": "<i", "f32": "<f"}
_PAYLOADS = {
    "HEAD": "STREAM_HEADER",
    "CANO": "CANONICAL",
    "FRAM": "FRAME",
    "came": "CAMERAS",
    "meta": "METADATA",
    "SNAP": "SNAPSHOT",
    "INDX": "INDEX",
    "TAIL": "TAIL",
}


@dataclass(frozen=True)
class Row:
    """A field of a stream: offset, bytes and value."""

    offset: int
    data: bytes
    field: str
    value: str


@dataclass(frozen=True)
class PlainChunk:
    kind: str
    offset: int
    sequence: int
    fields: dict[str, Any]


class FieldReader:
    """Takes fields from bytes and records each.

    Args:
        spec: Text with the tables to follow.
        data: A stream.
    """

    def __init__(self, spec: str, data: bytes) -> None:
        self._spec = spec
        self._data = data
        self.offset = 0
        self.rows: list[Row] = []
        self._has_updates = False

    def chunks(self) -> list[PlainChunk]:
        """The chunks of the whole stream; every CRC is checked."""
        magic = bytes.fromhex(re.search(r"magic, the eight bytes `([0-9A-F ]+)`", self._spec)[1])
        assert self._take("magic", len(magic), "") == magic
        chunks = []
        while self.offset < len(self._data):
            chunks.append(self._chunk())
        return chunks

    def _chunk(self) -> PlainChunk:
        start = self.offset
        header = self._table("CHUNK_HEADER", "")
        assert header["header_crc"] == zlib.crc32(self._data[start : self.offset - 4])
        first = self.offset
        kind = header["type"].decode()
        fields = self._table(self._layout(kind), "")
        if kind == "HEAD":
            self._has_updates = bool(fields["incompatible_features"] & 2)
        assert self.offset - first == header["length"], kind
        stored = self._number("payload_crc", "u32")
        assert stored == zlib.crc32(self._data[first : self.offset - 4])
        return PlainChunk(kind, start, header["sequence"], fields)

    def _layout(self, kind: str) -> str:
        return "FRAME_WITH_UPDATES" if kind == "FRAM" and self._has_updates else _PAYLOADS[kind]

    def _table(self, marker: str, prefix: str) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for row in spec_text.records(self._spec, f"syntax {marker}"):
            name = row["field"]
            values[name] = self._field(prefix + name, row["type"], row, values)
        return values

    def _field(self, name: str, kind: str, row: dict[str, str], known: dict[str, Any]) -> Any:
        if kind in _INTEGERS:
            return self._number(name, kind)
        if kind == "section":
            return self._table("SECTION", name + ".")
        if kind.startswith("text"):
            return self._text(name, {"text8": "u8", "text32": "u32"}[kind])
        if match := re.fullmatch(r"(\d+) bytes", kind):
            return self._take(name, int(match[1]), "ascii")
        count, inner = self._repeated(kind, row, known)
        if inner.isupper():
            return [self._table(inner, f"{name}[{i}].") for i in range(count)]
        return [self._field(f"{name}[{i}]", inner, row, known) for i in range(count)]

    def _repeated(self, kind: str, row: dict[str, str], known: dict[str, Any]) -> tuple[int, str]:
        if kind == "u32 each":
            return known[re.match(r"(\w+) words", row["meaning"])[1]], "u32"
        if match := re.fullmatch(r"(\d+) sections", kind):
            return int(match[1]), "section"
        match = re.fullmatch(r"(\w+) x (\w+)", kind)
        count = int(match[1]) if match[1].isdigit() else known[match[1]]
        return count, match[2]

    def _number(self, name: str, kind: str) -> Any:
        layout = _INTEGERS[kind]
        data = self._data[self.offset : self.offset + struct.calcsize(layout)]
        value = struct.unpack(layout, data)[0]
        shown = f"0x{value:08X}" if name.endswith("crc") or ".words[" in name else f"{value:.9g}"
        self._note(data, name, shown if kind == "f32" or shown[:2] == "0x" else str(value))
        return value

    def _text(self, name: str, kind: str) -> str:
        count = self._number(f"{name} (bytes)", kind)
        return self._take(name, count, "ascii").decode("utf-8")

    def _take(self, name: str, count: int, shown_as: str) -> bytes:
        data = self._data[self.offset : self.offset + count]
        assert len(data) == count, name
        readable = shown_as == "ascii" and data.isascii() and data.decode("ascii").isprintable()
        self._note(data, name, data.decode() if readable else "")
        return data

    def _note(self, data: bytes, name: str, value: str) -> None:
        self.rows.append(Row(self.offset, data, name, value))
        self.offset += len(data)
