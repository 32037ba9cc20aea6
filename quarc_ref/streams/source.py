"""Where the bytes of a stream are: anything that reads at an offset.

No I/O of its own: files, servers and pipes are in `quarc_ref.decoder`.
"""

from typing import Protocol


class Source(Protocol):
    """The bytes of a stream, read where they are needed."""

    def read(self, offset: int, length: int) -> bytes:
        """Return `length` bytes from `offset` on; fewer only at the end of what there is.

        Raises:
            SourceError: What holds the bytes does not give them.
        """
        ...

    def size(self) -> int | None:
        """Return how many bytes there are now; None where that cannot be told."""
        ...


class BytesSource:
    """A stream in memory."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def read(self, offset: int, length: int) -> bytes:
        """Return `length` bytes from `offset` on, fewer at the end."""
        return self._data[offset : offset + length]

    def size(self) -> int:
        """Return how many bytes there are."""
        return len(self._data)


def as_source(stream: bytes | Source) -> Source:
    """Return the source of a stream that may be given as bytes."""
    return BytesSource(stream) if isinstance(stream, bytes) else stream
