"""Reads and writes PLY files as tables with a row per vertex and a column per property.

Supported files are ascii or little-endian binary, and have `vertex` as their first element. The
size of every array is compared with the size of the file before the array is allocated.
"""

import re
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

_MAX_HEADER_BYTES = 1 << 16
_HEADER_PATTERN = re.compile(rb"ply\r?\n(.*?)^end_header\r?\n", re.DOTALL | re.MULTILINE)
_NUMPY_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "<i2",
    "int16": "<i2",
    "ushort": "<u2",
    "uint16": "<u2",
    "int": "<i4",
    "int32": "<i4",
    "uint": "<u4",
    "uint32": "<u4",
    "float": "<f4",
    "float32": "<f4",
    "double": "<f8",
    "float64": "<f8",
}

_PLY_TYPES = {"<f4": "float", "|u1": "uchar"}

Columns = dict[str, NDArray[np.generic]]


@dataclass(frozen=True, slots=True)
class PlyHeader:
    """The header of a PLY file.

    Attributes:
        is_ascii: Whether the vertices are stored as text.
        vertex_count: Number of vertices.
        vertex_type: Names and types of the vertex properties, as a structured NumPy type.
        data_offset: Offset of the first vertex in the file, bytes.
    """

    is_ascii: bool
    vertex_count: int
    vertex_type: np.dtype[np.void]
    data_offset: int

    @property
    def property_types(self) -> dict[str, str]:
        """NumPy type of each property without byte order, such as `f4`."""
        return {name: self.vertex_type[name].str[1:] for name in self.vertex_type.names or ()}


def build_ply_table(rows: NDArray[np.void]) -> bytes:
    """Build a binary little-endian PLY file of vertices.

    Args:
        rows: `[n]` structured array of little-endian `f4` and `u1` properties.
    """
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {rows.size}"]
    names = rows.dtype.names or ()
    header += [f"property {_PLY_TYPES[rows.dtype[name].str]} {name}" for name in names]
    return "\n".join([*header, "end_header", ""]).encode("ascii") + rows.tobytes()


def parse_ply_header(data: bytes) -> PlyHeader:
    """Parse the header of a PLY file.

    Args:
        data: The whole file, or its beginning.

    Raises:
        ValueError: The file is malformed, or has no vertices.
    """
    match = _HEADER_PATTERN.match(data[:_MAX_HEADER_BYTES])
    if match is None:
        message = "the file does not begin with a PLY header"
        raise ValueError(message)
    lines = [line.split() for line in match[1].decode("latin-1").splitlines()]
    lines = [words for words in lines if words and words[0] not in ("comment", "obj_info")]
    if not lines or lines[0][:2] not in (["format", "ascii"], ["format", "binary_little_endian"]):
        message = "the format is neither ascii nor binary_little_endian"
        raise ValueError(message)
    if len(lines) < 2 or lines[1][:2] != ["element", "vertex"]:
        message = "the first element is not 'vertex'"
        if lines[1:] and lines[1][:2] == ["element", "chunk"]:
            message = "a compressed PLY, as SuperSplat writes it, is not supported: export a PLY"
        raise ValueError(message)
    count_text = " ".join(lines[1][2:])
    if not count_text.isdecimal() or not int(count_text):
        message = f"the file has no points: the vertex count is {count_text!r}"
        raise ValueError(message)
    return PlyHeader(
        is_ascii=lines[0][1] == "ascii",
        vertex_count=int(count_text),
        vertex_type=_parse_vertex_type(lines[2:]),
        data_offset=match.end(),
    )


def read_ply_columns(data: bytes, header: PlyHeader) -> Columns:
    """Read the vertices of a PLY file.

    Args:
        data: The whole file.
        header: Header of the file.

    Returns:
        `[n]` values of each property by name. The values have the types in the header if the file
        is binary, and are float64 if it is ascii.

    Raises:
        ValueError: The file ends before its last vertex, or a number cannot be read.
    """
    read_vertices = _read_ascii if header.is_ascii else _read_binary
    return read_vertices(data[header.data_offset :], header)


def _read_binary(body: bytes, header: PlyHeader) -> Columns:
    if header.vertex_count * header.vertex_type.itemsize > len(body):
        message = f"the file ends before the last of {header.vertex_count} points"
        raise ValueError(message)
    rows = np.frombuffer(body, dtype=header.vertex_type, count=header.vertex_count)
    return {name: rows[name] for name in header.vertex_type.names or ()}


def _read_ascii(body: bytes, header: PlyHeader) -> Columns:
    names = header.vertex_type.names or ()
    rows = [line.split() for line in body.split(b"\n")[: header.vertex_count]]
    if len(rows) < header.vertex_count or any(len(row) != len(names) for row in rows):
        message = f"the file does not have {header.vertex_count} lines of {len(names)} numbers"
        raise ValueError(message)
    table = np.array(rows).astype(np.float64)
    return dict(zip(names, table.T, strict=True))


def _parse_vertex_type(lines: list[list[str]]) -> np.dtype[np.void]:
    """Parse the property lines that follow the line `element vertex`."""
    fields: list[tuple[str, str]] = []
    for words in takewhile(lambda words: words[0] != "element", lines):
        if len(words) != 3 or words[0] != "property" or words[1] not in _NUMPY_TYPES:
            message = f"a property of the points is not supported: '{' '.join(words[1:])}'"
            raise ValueError(message)
        fields.append((words[2], _NUMPY_TYPES[words[1]]))
    return np.dtype(fields)
