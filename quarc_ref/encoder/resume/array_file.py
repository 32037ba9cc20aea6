"""Stores named arrays in a file, which is rejected unless all of it matches a layout.

The file starts with a JSON line with a key, the type and shape of every array, and a CRC,
followed by the uncompressed bytes of the arrays. Types and shapes are compared with the
layout before any array is read, so that reading never takes more memory than the layout
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
Kind = tuple[str, tuple[int | str, ...]]
_Shapes = dict[str, tuple[str, tuple[int, ...]]]
_HEADER_LIMIT = 1 << 16


class ArrayFileError(Exception):
    """A file does not have the expected arrays."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Expected arrays of a file.

    Attributes:
        kinds: Type (`numpy.dtype.str`) and shape of each array. A dimension can be a
            name, which stands for the same length in all shapes.
        lengths: Allowed values of each named length.
    """

    kinds: dict[str, Kind]
    lengths: dict[str, range]

    def fits(self, found: _Shapes) -> bool:
        """Return whether arrays have the expected names, types and shapes."""
        lengths: dict[str, int] = {}
        return found.keys() == self.kinds.keys() and all(
            dtype == self.kinds[name][0] and self._fits(shape, self.kinds[name][1], lengths)
            for name, (dtype, shape) in found.items()
        )

    def _fits(
        self, shape: tuple[int, ...], expected: tuple[int | str, ...], lengths: dict[str, int]
    ) -> bool:
        """Return whether a shape is as expected, and record named lengths in `lengths`."""
        return len(shape) == len(expected) and all(
            length in self.lengths[place] and lengths.setdefault(place, length) == length
            if isinstance(place, str)
            else length == place
            for length, place in zip(shape, expected, strict=True)
        )


def write_arrays(sink: BinaryIO, key: str, arrays: Arrays) -> None:
    """Write arrays with a key that identifies their purpose."""
    shapes = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    header = {"key": key, "crc32": _compute_crc(arrays), "arrays": shapes}
    sink.write(json.dumps(header).encode() + b"\n")
    for array in arrays.values():
        sink.write(_as_bytes(array))


def read_arrays(file: BinaryIO, key: str, layout: Layout) -> Arrays:
    """Read the arrays of a file.

    Args:
        file: A regular file, opened at its beginning.
        key: Expected key.
        layout: Expected arrays.

    Raises:
        ArrayFileError: The key or the arrays are not the expected ones.
        OSError: The file cannot be read.
    """
    line = file.readline(_HEADER_LIMIT)
    found_key, crc, shapes = _parse(line)
    if found_key != key or not layout.fits(shapes):
        message = "the file does not have the expected arrays"
        raise ArrayFileError(message)
    sizes = {
        name: math.prod(shape) * np.dtype(dtype).itemsize for name, (dtype, shape) in shapes.items()
    }
    if len(line) + sum(sizes.values()) != os.fstat(file.fileno()).st_size:
        message = "the length of the file does not match its header"
        raise ArrayFileError(message)
    arrays: Arrays = {
        name: np.frombuffer(file.read(sizes[name]), dtype).reshape(shape).copy()
        for name, (dtype, shape) in shapes.items()
    }
    if _compute_crc(arrays) != crc:
        message = "the file is damaged"
        raise ArrayFileError(message)
    return arrays


def _parse(line: bytes) -> tuple[object, object, _Shapes]:
    """Parse key, CRC and shapes from the header."""
    try:
        header = json.loads(line)
        shapes = {
            name: (str(dtype), tuple(map(index, shape)))
            for name, (dtype, shape) in header["arrays"].items()
        }
        return header["key"], header["crc32"], shapes
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        message = "the file has no header"
        raise ArrayFileError(message) from error


def _compute_crc(arrays: Arrays) -> int:
    crc = 0
    for array in arrays.values():
        crc = zlib.crc32(_as_bytes(array), crc)
    return crc


def _as_bytes(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
