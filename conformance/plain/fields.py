"""Parses a stream with the syntax tables of SPEC 5, which are read from the text of SPEC.md.

This code contains no layouts of its own, so a mistake in a table leads to wrong fields.
"""

import re
import struct
import zlib
from dataclasses import dataclass
from typing import Any

from plain import spec_text

_NUMBER_FORMATS = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q", "i32": "<i", "f32": "<f"}
_PAYLOAD_TABLES = {
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
class FieldRow:
    """A field of a stream: its offset, bytes, name and value as text."""

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
    """Reads the fields of a stream, and records a row for each field.

    Args:
        spec: Text that contains the syntax tables, such as that of SPEC.md.
        data: Bytes of the stream.
    """

    def __init__(self, spec: str, data: bytes) -> None:
        self._spec = spec
        self._data = data
        self.offset = 0
        self.rows: list[FieldRow] = []
        self._has_updates = False

    def read_chunks(self) -> list[PlainChunk]:
        """Return all chunks of the stream, after checking their CRCs."""
        magic = bytes.fromhex(re.search(r"magic, the eight bytes `([0-9A-F ]+)`", self._spec)[1])
        assert self._take_bytes("magic", len(magic), "") == magic
        chunks = []
        while self.offset < len(self._data):
            chunks.append(self._read_chunk())
        return chunks

    def _read_chunk(self) -> PlainChunk:
        start = self.offset
        header = self._read_table("CHUNK_HEADER", "")
        assert header["header_crc"] == zlib.crc32(self._data[start : self.offset - 4])
        payload_start = self.offset
        kind = header["type"].decode()
        fields = self._read_table(self._get_table_name(kind), "")
        if kind == "HEAD":
            self._has_updates = bool(fields["incompatible_features"] & 2)
        assert self.offset - payload_start == header["length"], kind
        stored_crc = self._read_number("payload_crc", "u32")
        assert stored_crc == zlib.crc32(self._data[payload_start : self.offset - 4])
        return PlainChunk(kind, start, header["sequence"], fields)

    def _get_table_name(self, kind: str) -> str:
        return (
            "FRAME_WITH_UPDATES" if kind == "FRAM" and self._has_updates else _PAYLOAD_TABLES[kind]
        )

    def _read_table(self, marker: str, prefix: str) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for row in spec_text.read_records(self._spec, f"syntax {marker}"):
            name = row["field"]
            values[name] = self._read_field(prefix + name, row["type"], row, values)
        return values

    def _read_field(self, name: str, kind: str, row: dict[str, str], values: dict[str, Any]) -> Any:
        if kind in _NUMBER_FORMATS:
            return self._read_number(name, kind)
        if kind == "section":
            return self._read_table("SECTION", name + ".")
        if kind.startswith("text"):
            return self._read_text(name, {"text8": "u8", "text32": "u32"}[kind])
        if match := re.fullmatch(r"(\d+) bytes", kind):
            return self._take_bytes(name, int(match[1]), "ascii")
        count, element_type = self._parse_repetition(kind, row, values)
        if element_type.isupper():
            return [self._read_table(element_type, f"{name}[{i}].") for i in range(count)]
        return [self._read_field(f"{name}[{i}]", element_type, row, values) for i in range(count)]

    def _parse_repetition(
        self, kind: str, row: dict[str, str], values: dict[str, Any]
    ) -> tuple[int, str]:
        if kind == "u32 each":
            return values[re.match(r"(\w+) words", row["meaning"])[1]], "u32"
        if match := re.fullmatch(r"(\d+) sections", kind):
            return int(match[1]), "section"
        match = re.fullmatch(r"(\w+) x (\w+)", kind)
        count = int(match[1]) if match[1].isdigit() else values[match[1]]
        return count, match[2]

    def _read_number(self, name: str, kind: str) -> Any:
        number_format = _NUMBER_FORMATS[kind]
        data = self._data[self.offset : self.offset + struct.calcsize(number_format)]
        value = struct.unpack(number_format, data)[0]
        text = f"0x{value:08X}" if name.endswith("crc") or ".words[" in name else f"{value:.9g}"
        self._record_row(data, name, text if kind == "f32" or text[:2] == "0x" else str(value))
        return value

    def _read_text(self, name: str, kind: str) -> str:
        byte_count = self._read_number(f"{name} (bytes)", kind)
        return self._take_bytes(name, byte_count, "ascii").decode("utf-8")

    def _take_bytes(self, name: str, byte_count: int, display: str) -> bytes:
        data = self._data[self.offset : self.offset + byte_count]
        assert len(data) == byte_count, name
        is_readable = display == "ascii" and data.isascii() and data.decode("ascii").isprintable()
        self._record_row(data, name, data.decode() if is_readable else "")
        return data

    def _record_row(self, data: bytes, name: str, value: str) -> None:
        self.rows.append(FieldRow(self.offset, data, name, value))
        self.offset += len(data)
