"""Sources of streams: anything that reads bytes at an offset.

No I/O of its own: files, servers and pipes are in `quarc_ref.decoder`.
"""

from typing import Protocol


class Source(Protocol):
    """Random access to the bytes of a stream."""

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`; fewer only at the current end.

        Raises:
            SourceError: The file, pipe or server cannot be read.
        """
        ...

    def size(self) -> int | None:
        """Current size in bytes; None if it is unknown."""
        ...


class BytesSource:
    """A stream in memory."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, fewer at the end."""
        return self._data[offset : offset + length]

    def size(self) -> int:
        """Size in bytes."""
        return len(self._data)


def as_source(stream: bytes | Source) -> Source:
    """Wrap bytes in a source; return a source unchanged."""
    return BytesSource(stream) if isinstance(stream, bytes) else stream
