"""Sources of streams in files, pipes and, by URL, on servers (SPEC 11.2)."""

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
        file: Opened for reading, in binary.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, fewer at the end of the file."""
        missing = max(0, min(length, self.size() - offset))
        self._file.seek(offset if missing else 0)
        pieces = []
        while missing and (piece := self._file.read(missing)):  # as much as the system gives
            pieces.append(piece)
            missing -= len(piece)
        return b"".join(pieces)

    def size(self) -> int:
        """Current size of the file, bytes."""
        return os.fstat(self._file.fileno()).st_size


class PipeSource:
    """A stream that can be read once, in order.

    Args:
        pipe: Binary file that is read no further than requested.
        kept_bytes: How far back a read may go: what `recover` needs after
            damage is the longest chunk of the stream.
    """

    def __init__(self, pipe: BinaryIO, kept_bytes: int = _KEPT_BYTES) -> None:
        self._pipe = pipe
        self._kept_bytes = kept_bytes
        self._kept = bytearray()
        self._start = 0  # offset of the first byte that is kept

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
        """None: the size of a pipe is unknown."""
        return

    def _forget(self, offset: int) -> None:
        """Drop bytes that are too far back to be read again."""
        gone = min(offset - self._start, len(self._kept) - self._kept_bytes)
        if gone > 0:
            del self._kept[:gone]
            self._start += gone


@contextmanager
def open_source(name: str) -> Iterator[Source]:
    """Open a stream by path, URL or `-`.

    Args:
        name: A path, also of a named pipe; an HTTP URL; or `-` for standard input.

    Raises:
        OSError: The file cannot be opened.
        SourceError: The server cannot be reached.
    """
    if name == "-":
        yield PipeSource(sys.stdin.buffer)
    elif name.startswith(("http://", "https://")):
        from quarc_ref.streams.http_source import HttpSource  # loads the whole of urllib

        yield HttpSource(name)
    else:
        with Path(name).open("rb", buffering=0) as file:
            is_file = stat.S_ISREG(os.fstat(file.fileno()).st_mode)
            yield FileSource(file) if is_file else PipeSource(file)
