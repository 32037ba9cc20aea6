"""Copies streams that can be read only once, such as pipes, to temporary files."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from tempfile import TemporaryFile, gettempdir
from threading import Lock, Thread
from typing import TYPE_CHECKING, BinaryIO, Protocol

from quarc_ref.cli.output import print_message
from quarc_ref.format.errors import BitstreamError, QuarcError, SourceError

if TYPE_CHECKING:
    from quarc_ref.streams import Source

_PIECE_BYTES = 1 << 16


class _Sink(Protocol):
    """An unbuffered binary file, whose `write` may accept only some of the bytes."""

    def write(self, piece: bytes, /) -> int:
        """Write bytes, and return how many were written."""
        ...


@contextmanager
def open_seekable(source: "Source") -> "Iterator[Source]":
    """Yield a stream that can be read repeatedly; a pipe is copied to a temporary file.

    Raises:
        SourceError: The temporary file cannot be written, for example because the disk is full.
    """
    from quarc_ref.streams import FileSource

    if source.size() is not None:
        yield source
        return
    with TemporaryFile(buffering=0) as file:
        _copy_chunks(source, file)
        yield FileSource(file)


def _copy_chunks(source: "Source", file: _Sink) -> None:
    """Copy a stream chunk by chunk, so that endless input that is not a stream is rejected."""
    from quarc_ref.streams.chunk_reader import ChunkReader

    copying_source = _CopyingSource(source, file)
    reader = ChunkReader(copying_source)
    with suppress(BitstreamError):  # the reader of the copy finds the same error
        reader.read_chunk()
        for header in reader.headers():
            copying_source.copy_until(header.end)


@contextmanager
def growing_copy(source: "Source") -> "Iterator[Source]":
    """Yield a copy of a stream in a temporary file, which grows while the stream is received.

    An error of the copying thread is printed to standard error, and ends the copy.
    """
    with TemporaryFile(buffering=0) as file:
        copy = _GrowingCopy(file)
        Thread(target=_fill_copy, args=(source, copy), daemon=True).start()
        try:
            yield copy
        finally:
            copy.close()


def _fill_copy(source: "Source", copy: "_GrowingCopy") -> None:
    try:
        _copy_chunks(source, copy)
    except (QuarcError, OSError) as error:
        print_message(str(error))


class _GrowingCopy:
    """Copy of a stream in a file, which one thread writes and other threads read.

    Args:
        file: Empty file, open for writing and reading.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = 0
        self._lock = Lock()
        self._is_closed = False

    def write(self, piece: bytes) -> int:
        """Append bytes, and return how many were written; after `close`, discard the bytes."""
        with self._lock:
            if self._is_closed:
                return len(piece)
            self._file.seek(self._size)
            written_bytes = self._file.write(piece)
            self._size += written_bytes
            return written_bytes

    def read(self, offset: int, length: int) -> bytes:
        """Return the bytes at `offset` that have been received, at most `length`.

        After `close`, return no bytes, because another thread may still serve a request.
        """
        with self._lock:
            if self._is_closed:
                return b""
            available_bytes = max(0, min(length, self._size - offset))
            self._file.seek(offset if available_bytes else 0)
            return self._file.read(available_bytes)

    def size(self) -> int:
        """Return the number of bytes received so far."""
        return self._size

    def close(self) -> None:
        """Stop reading and writing the file, before the caller closes it."""
        with self._lock:
            self._is_closed = True


class _CopyingSource:
    """A source that also writes all bytes that it reads to a file.

    Args:
        source: The stream.
        file: The copy, opened for writing and reading.
    """

    def __init__(self, source: "Source", file: _Sink) -> None:
        self._source = source
        self._file = file
        self._copied_bytes = 0

    def read(self, offset: int, length: int) -> bytes:
        """Copy all bytes before `offset + length`, then read up to `length` bytes at `offset`."""
        self.copy_until(offset + length)
        return self._source.read(offset, length)

    def size(self) -> None:
        """Return None, because the size is unknown."""
        return

    def copy_until(self, offset: int) -> None:
        """Copy all bytes before an offset, except those that have been copied already."""
        while self._copied_bytes < offset:
            size = min(_PIECE_BYTES, offset - self._copied_bytes)
            piece = self._source.read(self._copied_bytes, size)
            if not piece:
                return
            self._write(piece)
            self._copied_bytes += len(piece)

    def _write(self, piece: bytes) -> None:
        try:
            while piece:
                piece = piece[self._file.write(piece) :]
        except OSError as error:
            message = (
                f"the stream does not fit into {gettempdir()}: {error.strerror}; save it to a "
                "file, or set TMPDIR to a folder with more space"
            )
            raise SourceError(message) from error
