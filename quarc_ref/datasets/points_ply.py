"""Reads and writes colored points in PLY files: `x y z` and `red green blue`.

Ascii and little-endian binary files can be read; properties other than position and color are
ignored. Written files are little-endian binary.
"""

from pathlib import Path

import numpy as np

from quarc_ref.datasets.capture import Points, require_finite
from quarc_ref.datasets.errors import MissingFileError, UnreadablePointsError
from quarc_ref.datasets.ply_table import (
    Columns,
    build_ply_table,
    parse_ply_header,
    read_ply_columns,
)
from quarc_ref.files import write_file

_AXES = ("x", "y", "z")
_COLOR_CHANNELS = ("red", "green", "blue")
_MAX_COLOR = 255
_VERTEX_TYPE = np.dtype(
    [(name, "<f4") for name in _AXES] + [(name, "u1") for name in _COLOR_CHANNELS]
)


def read_points_ply(path: Path) -> Points:
    """Read the points of a PLY file.

    Args:
        path: Path of an ascii or little-endian binary file whose first element is
            `vertex`, with floating-point x, y, z and uchar red, green, blue.

    Raises:
        MissingFileError: The file cannot be read.
        UnreadablePointsError: The file is malformed, or has no points.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MissingFileError.of(path, error) from error
    try:
        columns = _read_columns(data)
    except ValueError as error:
        message = f"{path}: {error}; export it as a binary PLY with x, y, z, red, green and blue"
        raise UnreadablePointsError(message) from error
    try:
        return _make_points(columns)
    except ValueError as error:
        message = f"{path}: {error}"
        raise UnreadablePointsError(message) from error


def write_points_ply(path: Path, points: Points) -> None:
    """Write points as a little-endian binary PLY file.

    Args:
        path: Path of the file; an existing file is replaced.
        points: Points to write.
    """
    rows = np.empty(len(points.positions), dtype=_VERTEX_TYPE)
    for index, name in enumerate(_AXES):
        rows[name] = points.positions[:, index]
    for index, name in enumerate(_COLOR_CHANNELS):
        rows[name] = points.colors[:, index]
    write_file(path, build_ply_table(rows))


def _read_columns(data: bytes) -> Columns:
    header = parse_ply_header(data)
    _require_properties(header.property_types)
    return read_ply_columns(data, header)


def _make_points(columns: Columns) -> Points:
    with np.errstate(over="ignore"):
        positions = np.stack([columns[name] for name in _AXES], axis=1).astype(np.float32)
    require_finite(positions)
    colors = np.stack([columns[name] for name in _COLOR_CHANNELS], axis=1).astype(np.float64)
    if not ((colors >= 0) & (colors <= _MAX_COLOR)).all():
        message = f"a color is not between 0 and {_MAX_COLOR}"
        raise ValueError(message)
    return Points(positions, colors.astype(np.uint8))


def _require_properties(types: dict[str, str]) -> None:
    """Raise ValueError unless the vertices have positions and colors of supported types."""
    if any(types.get(name) not in ("f4", "f8") for name in _AXES):
        message = "the points have no properties x, y and z of type float or double"
        raise ValueError(message)
    if any(types.get(name) != "u1" for name in _COLOR_CHANNELS):
        message = "the points have no properties red, green and blue of type uchar"
        raise ValueError(message)
