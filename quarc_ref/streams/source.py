"""The interface of sources, which return the bytes of a stream at an offset.

The sources for files, pipes and servers are in `sources` and `http_source`.
"""

from mmap import mmap
from typing import Protocol

BytesLike = bytes | bytearray | memoryview | mmap


class Source(Protocol):
    """Random access to the bytes of a stream."""

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, or fewer at the current end of the stream.

        Raises:
            SourceError: The file, pipe or server cannot be read.
        """
        ...

    def size(self) -> int | None:
        """Return the current size in bytes; None if unknown."""
        ...


class BytesSource:
    """A stream in memory, which is not copied.

    Args:
        data: The bytes; a mapped file must not be closed while it is read.
    """

    def __init__(self, data: BytesLike) -> None:
        self._data = memoryview(data).cast("B")

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, or fewer at the end."""
        return bytes(self._data[offset : offset + length])

    def size(self) -> int:
        """Return the size in bytes."""
        return len(self._data)


def as_source(stream: BytesLike | Source) -> Source:
    """Wrap bytes in a source; return a source unchanged.

    Raises:
        TypeError: The argument is neither.
    """
    if isinstance(stream, BytesLike):
        return BytesSource(stream)
    if not callable(getattr(stream, "size", None)):  # an array of NumPy has a number
        message = (
            f"a stream is bytes or a source, not {type(stream).__name__}: open files with "
            "open_source"
        )
        raise TypeError(message)
    return stream
