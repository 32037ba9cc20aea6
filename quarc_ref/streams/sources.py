"""Sources of streams in files and pipes, and on servers by URL (SPEC 11.2)."""

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import SourceError
from quarc_ref.streams.source import Source

_PIECE_BYTES = 1 << 16
_KEPT_BYTES = LEVELS[30].chunk_bytes


class FileSource:
    """A stream in a file, which may be growing.

    Args:
        file: Binary file, open for reading.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, fewer at the end of the file."""
        missing = max(0, min(length, self.size() - offset))
        self._file.seek(offset if missing else 0)
        pieces = []
        while missing and (piece := self._file.read(missing)):  # the system may return fewer bytes
            pieces.append(piece)
            missing -= len(piece)
        return b"".join(pieces)

    def size(self) -> int:
        """Return the current size of the file in bytes."""
        return os.fstat(self._file.fileno()).st_size


class PipeSource:
    """A stream that can be read once, in order.

    Args:
        pipe: Binary file, which is read only as far as requested.
        kept_bytes: Number of past bytes to keep; `recover` needs the longest chunk of the
            stream after damage.
    """

    def __init__(self, pipe: BinaryIO, kept_bytes: int = _KEPT_BYTES) -> None:
        self._pipe = pipe
        self._kept_bytes = kept_bytes
        self._kept = bytearray()
        self._start = 0  # offset of the first kept byte

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, fewer at the end of the pipe.

        Raises:
            SourceError: The bytes were already read and are not kept.
        """
        if offset < self._start:
            message = f"cannot seek back to byte {offset} in a pipe: save the stream to a file"
            raise SourceError(message)
        while (missing := offset + length - self._start - len(self._kept)) > 0:
            piece = self._pipe.read(min(missing, _PIECE_BYTES))
            if not piece:
                break
            self._kept += piece
            self._forget(offset)
        place = offset - self._start
        return bytes(self._kept[place : place + length])

    def size(self) -> None:
        """Return None, because the size of a pipe is unknown."""
        return

    def _forget(self, offset: int) -> None:
        """Drop bytes that need not be kept."""
        gone = min(offset - self._start, len(self._kept) - self._kept_bytes)
        if gone > 0:
            del self._kept[:gone]
            self._start += gone


@contextmanager
def open_source(name: str) -> Iterator[Source]:
    """Open a stream by path, URL or `-`.

    Args:
        name: A path, which may be that of a named pipe; an HTTP URL; or `-` for standard input.

    Raises:
        OSError: The file cannot be opened.
        SourceError: The server cannot be reached.
    """
    if name == "-":
        yield PipeSource(sys.stdin.buffer)
    elif name.startswith(("http://", "https://")):
        from quarc_ref.streams.http_source import HttpSource  # imports all of urllib

        yield HttpSource(name)
    else:
        with Path(name).open("rb", buffering=0) as file:
            is_file = stat.S_ISREG(os.fstat(file.fileno()).st_mode)
            yield FileSource(file) if is_file else PipeSource(file)
