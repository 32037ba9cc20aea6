"""Points with colors in PLY files: `x y z` and `red green blue`.

Reads ascii and little-endian binary files, whatever other properties a point
has, and writes little-endian binary ones. The size of every array is proved
against the bytes that are there before it is made.
"""

import re
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.errors import MissingFileError, UnreadablePointsError
from quarc_ref.files import write_file

_HEADER_LIMIT = 1 << 16
_HEADER = re.compile(rb"ply\r?\n(.*?)^end_header\r?\n", re.DOTALL | re.MULTILINE)
_AXES = ("x", "y", "z")
_COLORS = ("red", "green", "blue")
_BRIGHTEST = 255
_TYPES = {
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
_WRITTEN = np.dtype([(name, "<f4") for name in _AXES] + [(name, "u1") for name in _COLORS])


def read_points_ply(path: Path) -> Points:
    """Return the points of a PLY file.

    Args:
        path: Of an ascii or little-endian binary file, its vertices first, with
            floating-point x, y, z and uchar red, green, blue among the properties.

    Raises:
        MissingFileError: The file cannot be read.
        UnreadablePointsError: The file is malformed, or has no points.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        message = f"{path} cannot be read: {error}"
        raise MissingFileError(message) from error
    try:
        return _parse(data)
    except ValueError as error:
        message = f"{path}: {error}; export it as a binary PLY of x, y, z, red, green, blue"
        raise UnreadablePointsError(message) from error


def write_points_ply(path: Path, points: Points) -> None:
    """Write points as a little-endian binary PLY file.

    Args:
        path: Of the file; one that is there is replaced.
        points: To write.
    """
    rows = np.empty(len(points.positions), dtype=_WRITTEN)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {rows.size}"]
    for index, name in enumerate(_AXES):
        rows[name] = points.positions[:, index]
        header.append(f"property float {name}")
    for index, name in enumerate(_COLORS):
        rows[name] = points.colors[:, index]
        header.append(f"property uchar {name}")
    text = "\n".join([*header, "end_header\n"])
    write_file(path, text.encode("ascii") + rows.tobytes())


@dataclass(frozen=True, slots=True)
class _Header:
    """How the points are written, and where they begin."""

    is_ascii: bool
    count: int
    row: np.dtype[np.void]
    start: int


def _parse(data: bytes) -> Points:
    header = _parse_header(data)
    read = _read_ascii if header.is_ascii else _read_binary
    columns = read(data[header.start :], header)
    with np.errstate(over="ignore"):
        positions = np.stack([columns[name] for name in _AXES], axis=1).astype(np.float32)
    if not np.isfinite(positions).all():
        message = "a position is not finite"
        raise ValueError(message)
    colors = np.stack([columns[name] for name in _COLORS], axis=1)
    if not ((colors >= 0) & (colors <= _BRIGHTEST)).all():
        message = f"a color is not within 0 to {_BRIGHTEST}"
        raise ValueError(message)
    return Points(positions, colors.astype(np.uint8))


def _read_binary(body: bytes, header: _Header) -> dict[str, NDArray[np.generic]]:
    if header.count * header.row.itemsize > len(body):
        message = f"it ends before the last of its {header.count} points"
        raise ValueError(message)
    rows = np.frombuffer(body, dtype=header.row, count=header.count)
    return {name: rows[name] for name in header.row.names or ()}


def _read_ascii(body: bytes, header: _Header) -> dict[str, NDArray[np.generic]]:
    names = header.row.names or ()
    values = [line.split() for line in body.split(b"\n")[: header.count]]
    if len(values) < header.count or any(len(row) != len(names) for row in values):
        message = f"it has no {header.count} lines of {len(names)} numbers"
        raise ValueError(message)
    table = np.array(values).astype(np.float64)
    return dict(zip(names, table.T, strict=True))


def _parse_header(data: bytes) -> _Header:
    head = _HEADER.match(data[:_HEADER_LIMIT])
    if head is None:
        message = "it does not begin with the header of a PLY file"
        raise ValueError(message)
    lines = [line.split() for line in head[1].decode("latin-1").splitlines()]
    lines = [words for words in lines if words and words[0] not in ("comment", "obj_info")]
    if not lines or lines[0][:2] not in (["format", "ascii"], ["format", "binary_little_endian"]):
        message = "its format is neither ascii nor binary_little_endian"
        raise ValueError(message)
    if len(lines) < 2 or lines[1][:2] != ["element", "vertex"]:
        message = "its first element is not the vertex"
        raise ValueError(message)
    count = " ".join(lines[1][2:])
    if not count.isdecimal() or not int(count):
        message = f"it has no points, but '{count}'"
        raise ValueError(message)
    return _Header(lines[0][1] == "ascii", int(count), _parse_row(lines[2:]), head.end())


def _parse_row(lines: list[list[str]]) -> np.dtype[np.void]:
    """Return the layout of a point from the lines after its element's."""
    fields: list[tuple[str, str]] = []
    for words in takewhile(lambda words: words[0] != "element", lines):
        if len(words) != 3 or words[0] != "property" or words[1] not in _TYPES:
            message = f"a point cannot have the property '{' '.join(words[1:])}'"
            raise ValueError(message)
        fields.append((words[2], _TYPES[words[1]]))
    types = dict(fields)
    if any(types.get(name, "")[-2:] not in ("f4", "f8") for name in _AXES):
        message = "its points have no float or double x, y and z"
        raise ValueError(message)
    if any(types.get(name) != "u1" for name in _COLORS):
        message = "its points have no uchar red, green and blue"
        raise ValueError(message)
    return np.dtype(fields)
