"""Stores named arrays in a file, and rejects files with a different layout.

The file starts with a JSON line that contains a key, a CRC, and the type and shape of every
array. The uncompressed bytes of the arrays follow this line. Types and shapes are compared with
the layout before any array is read, so that reading never takes more memory than the layout
allows.
"""

import json
import math
import os
import zlib
from dataclasses import dataclass
from operator import index
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]
ArrayType = tuple[str, tuple[int | str, ...]]
_ArrayTypes = dict[str, tuple[str, tuple[int, ...]]]
_MAX_HEADER_BYTES = 1 << 16


class ArrayFileError(Exception):
    """A file is damaged, or does not contain the expected arrays."""


class OtherKeyError(ArrayFileError):
    """A file has a different key.

    Attributes:
        key: The key of the file.
    """

    def __init__(self, key: str) -> None:
        super().__init__("the file has a different key")
        self.key = key


@dataclass(frozen=True, slots=True)
class Layout:
    """Types and shapes that the arrays of a file must have.

    Attributes:
        array_types: Type (`numpy.dtype.str`) and shape of each array. A dimension is a number
            or a name; a name stands for the same length in all shapes.
        lengths: Allowed values of each named dimension.
    """

    array_types: dict[str, ArrayType]
    lengths: dict[str, range]

    def matches(self, array_types: _ArrayTypes) -> bool:
        """Return whether arrays have the expected names, types and shapes."""
        lengths: dict[str, int] = {}
        return array_types.keys() == self.array_types.keys() and all(
            dtype == self.array_types[name][0]
            and self._matches_shape(shape, self.array_types[name][1], lengths)
            for name, (dtype, shape) in array_types.items()
        )

    def _matches_shape(
        self, shape: tuple[int, ...], expected_shape: tuple[int | str, ...], lengths: dict[str, int]
    ) -> bool:
        """Return whether a shape matches; store the lengths of named dimensions in `lengths`."""
        return len(shape) == len(expected_shape) and all(
            length in self.lengths[dimension] and lengths.setdefault(dimension, length) == length
            if isinstance(dimension, str)
            else length == dimension
            for length, dimension in zip(shape, expected_shape, strict=True)
        )


def write_arrays(sink: BinaryIO, key: str, arrays: Arrays) -> None:
    """Write arrays to a file.

    Args:
        sink: Binary file to which the header and the arrays are appended.
        key: Text that identifies the content; `read_arrays` rejects files with a different key.
        arrays: Arrays by name.
    """
    array_types = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    header = {"key": key, "crc32": _compute_crc(arrays), "arrays": array_types}
    sink.write(json.dumps(header).encode() + b"\n")
    for array in arrays.values():
        sink.write(_as_bytes(array))


def read_arrays(file: BinaryIO, key: str, layout: Layout) -> Arrays:
    """Read the arrays of a file.

    Args:
        file: A regular file, opened at its beginning.
        key: Expected key.
        layout: Expected types and shapes.

    Raises:
        OtherKeyError: The file has a different key.
        ArrayFileError: The file is damaged, or its types or shapes are not as expected.
        OSError: The file cannot be read.
    """
    header_line = file.readline(_MAX_HEADER_BYTES)
    found_key, crc, array_types = _parse_header(header_line)
    if found_key != key:
        raise OtherKeyError(str(found_key))
    if not layout.matches(array_types):
        message = "the file does not contain the expected arrays"
        raise ArrayFileError(message)
    byte_counts = {
        name: math.prod(shape) * np.dtype(dtype).itemsize
        for name, (dtype, shape) in array_types.items()
    }
    if len(header_line) + sum(byte_counts.values()) != os.fstat(file.fileno()).st_size:
        message = "the length of the file does not match its header"
        raise ArrayFileError(message)
    arrays: Arrays = {
        name: np.frombuffer(file.read(byte_counts[name]), dtype).reshape(shape).copy()
        for name, (dtype, shape) in array_types.items()
    }
    if _compute_crc(arrays) != crc:
        message = "the file is damaged: its CRC is wrong"
        raise ArrayFileError(message)
    return arrays


def _parse_header(line: bytes) -> tuple[object, object, _ArrayTypes]:
    """Parse the header line; return the key, the CRC, and types and shapes by array name."""
    try:
        header = json.loads(line)
        array_types = {
            name: (str(dtype), tuple(map(index, shape)))
            for name, (dtype, shape) in header["arrays"].items()
        }
        return header["key"], header["crc32"], array_types
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        message = "the first line of the file is not a valid header"
        raise ArrayFileError(message) from error


def _compute_crc(arrays: Arrays) -> int:
    crc = 0
    for array in arrays.values():
        crc = zlib.crc32(_as_bytes(array), crc)
    return crc


def _as_bytes(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
