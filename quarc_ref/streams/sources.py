"""Sources of streams in files, in pipes and on servers (SPEC 11.2)."""

import os
import select
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import RawIOBase
from pathlib import Path
from threading import Lock
from typing import BinaryIO

from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import SourceError
from quarc_ref.streams.follow import Follow
from quarc_ref.streams.source import Source

_PIECE_BYTES = 1 << 16
_BUFFER_BYTES = LEVELS[30].chunk_bytes + (2 << 20)  # a payload, and a window of a search


class FileSource:
    """A stream in a file, which may be growing. Threads can share it.

    Args:
        file: Binary file, open for reading.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._lock = Lock()  # held from a seek to the end of its read

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, or fewer at the end of the file."""
        missing_bytes = max(0, min(length, self.size() - offset))
        pieces = []
        with self._lock:
            self._file.seek(offset if missing_bytes else 0)
            while missing_bytes and (
                piece := self._file.read(missing_bytes)
            ):  # the system may return fewer bytes
                pieces.append(piece)
                missing_bytes -= len(piece)
        return b"".join(pieces)

    def size(self) -> int:
        """Return the current size of the file in bytes."""
        return os.fstat(self._file.fileno()).st_size


class PipeSource:
    """A stream that can be read only once, from beginning to end.

    Args:
        pipe: Binary file; no more bytes are read from it than requested.
        buffer_bytes: Number of past bytes to keep. To resume after damage, `recover` needs the
            size of the stream's longest chunk, and that of a search window.
    """

    def __init__(self, pipe: BinaryIO | RawIOBase, buffer_bytes: int = _BUFFER_BYTES) -> None:
        self._pipe = pipe
        self._buffer_bytes = buffer_bytes
        self._buffer = bytearray()
        self._buffer_offset = 0  # offset of the first kept byte

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, or fewer at the end of the pipe.

        Raises:
            SourceError: The bytes are no longer in the buffer.
        """
        if offset < self._buffer_offset:
            message = f"cannot seek back to byte {offset} in a pipe: save the stream to a file"
            raise SourceError(message)
        while (missing_bytes := offset + length - self._buffer_offset - len(self._buffer)) > 0:
            piece = self._read_piece(min(missing_bytes, _PIECE_BYTES))
            if not piece:
                break
            self._buffer += piece
            self._trim_buffer(offset)
        start = offset - self._buffer_offset
        return bytes(self._buffer[start : start + length])

    def size(self) -> None:
        """Return None, because the size of a pipe is unknown."""
        return

    def _read_piece(self, length: int) -> bytes:
        """Read at most `length` bytes; no bytes mean the end of the pipe.

        A pipe that another program made non-blocking returns None while it has no data.
        """
        while (piece := self._pipe.read(length)) is None:
            select.select([self._pipe], [], [])
        return piece

    def _trim_buffer(self, offset: int) -> None:
        """Drop the oldest bytes if the buffer contains more than `buffer_bytes`."""
        excess_bytes = min(offset - self._buffer_offset, len(self._buffer) - self._buffer_bytes)
        if excess_bytes > 0:
            del self._buffer[:excess_bytes]
            self._buffer_offset += excess_bytes


@contextmanager
def open_source(name: str | os.PathLike[str], follow: Follow | None = None) -> Iterator[Source]:
    """Open a stream by path, URL or `-`.

    Args:
        name: Path of a file or named pipe, HTTP URL, or `-` for standard input.
        follow: How to wait for a growing stream: requests that fail temporarily are repeated for
            its patience; None to repeat them a few times.

    Raises:
        OSError: The file cannot be opened.
        SourceError: The server cannot be reached, or standard input is closed.
    """
    name = os.fspath(name)
    if name == "-":
        if sys.stdin is None:
            message = "standard input is closed"
            raise SourceError(message)
        # Unbuffered: Python aborts at exit if a thread still waits in a read of the buffer.
        yield PipeSource(getattr(sys.stdin.buffer, "raw", sys.stdin.buffer))
    elif name.lower().startswith(("http://", "https://")):
        from quarc_ref.streams.http_source import HttpSource  # imports all of urllib

        yield HttpSource(name) if follow is None else HttpSource(name, patience=follow.patience)
    else:
        with Path(name).open("rb", buffering=0) as file:
            is_file = stat.S_ISREG(os.fstat(file.fileno()).st_mode)
            yield FileSource(file) if is_file else PipeSource(file)
