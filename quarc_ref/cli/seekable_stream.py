"""A stream that comes only once, for a verb that reads it more than once."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from tempfile import TemporaryFile, gettempdir
from typing import TYPE_CHECKING, BinaryIO

from quarc_ref.format.errors import BitstreamError, SourceError

if TYPE_CHECKING:
    from quarc_ref.streams import Source

_PIECE_BYTES = 1 << 16


@contextmanager
def seekable_stream(source: "Source") -> "Iterator[Source]":
    """Yield a stream that can be read again; what comes only once is copied to a temporary file.

    Raises:
        SourceError: There is no room for the file.
    """
    from quarc_ref.streams import FileSource

    if source.size() is not None:
        yield source
        return
    with TemporaryFile(buffering=0) as file:
        _copy(source, file)
        yield FileSource(file)


def _copy(source: "Source", file: BinaryIO) -> None:
    """Copy a stream as far as one chunk follows the other: what is not a stream may not end."""
    from quarc_ref.streams.chunk_reader import ChunkReader

    copying = _Copying(source, file)
    reader = ChunkReader(copying)
    with suppress(BitstreamError):  # whoever reads the copy meets it there
        reader.read_chunk()
        while (header := reader.read_header()) is not None:
            copying.go_to(header.end)
            reader.skip(header)


class _Copying:
    """Copies a stream up to where it is read.

    Args:
        source: The stream.
        file: Is written to.
    """

    def __init__(self, source: "Source", file: BinaryIO) -> None:
        self._source = source
        self._file = file
        self._copied = 0

    def read(self, offset: int, length: int) -> bytes:
        """Return `length` bytes from `offset` on, fewer at the end."""
        self.go_to(offset + length)
        return self._source.read(offset, length)

    def size(self) -> None:
        """Return that it cannot be told how many bytes will come."""
        return

    def go_to(self, offset: int) -> None:
        """Copy what comes before an offset."""
        while self._copied < offset:
            size = min(_PIECE_BYTES, offset - self._copied)
            piece = self._source.read(self._copied, size)
            if not piece:
                return
            self._write(piece)
            self._copied += len(piece)

    def _write(self, piece: bytes) -> None:
        try:
            while piece:
                piece = piece[self._file.write(piece) :]
        except OSError as error:
            message = (
                f"the stream does not fit in {gettempdir()}: {error.strerror}; "
                "save it in a file, or set TMPDIR to a folder with more room"
            )
            raise SourceError(message) from error
