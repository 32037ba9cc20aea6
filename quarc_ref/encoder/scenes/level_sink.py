"""Raises the level of a stream when a frame needs a higher one.

HEAD states the level, but it is written before all frames are known. The encoder therefore codes
at the unlimited level, and this sink writes the HEAD of the stream: first with a level that is
likely to suffice, and again if a frame exceeds it. No other chunk depends on the level.
"""

import os
import sys
from contextlib import suppress
from dataclasses import replace
from typing import BinaryIO

from quarc_ref.format import container, wire
from quarc_ref.format.constants import (
    CHUNK_CRC_BYTES,
    CHUNK_HEADER_BYTES,
    LEVELS,
    MAGIC,
    Level,
)
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader

UNLIMITED_LEVEL = max(LEVELS)


class LevelSink:
    """A sink that replaces HEAD, and raises its level if a frame or a chunk exceeds the limits.

    Args:
        sink: Binary file to which the stream is appended.
        header: Header of the stream, with the level to begin with.
    """

    def __init__(self, sink: BinaryIO, header: StreamHeader) -> None:
        self._sink = sink
        self._header = header
        self._start = _find_start(sink)
        self._has_head = False

    @property
    def limits(self) -> Level:
        """Limits of the current level."""
        return self._header.limits

    def write(self, data: bytes) -> int:
        """Write a chunk; the first call writes HEAD with the current level instead.

        Raises:
            EncodeError: The chunk needs a higher level, but HEAD cannot be written again.
        """
        if self._has_head:
            payload_bytes = len(data) - CHUNK_HEADER_BYTES - CHUNK_CRC_BYTES
            self._raise_level(f"a chunk of {payload_bytes:,} bytes", chunk_bytes=payload_bytes)
            self._sink.write(data)
        else:
            self._has_head = True
            self._sink.write(self._build_head())
        return len(data)

    def flush(self) -> None:
        """Flush the file."""
        self._sink.flush()

    def require_gaussians(self, count: int) -> None:
        """Raise the level if it allows fewer than `count` Gaussians.

        Raises:
            EncodeError: A higher level is needed, but HEAD cannot be written again.
        """
        self._raise_level(f"{count:,} Gaussians", gaussians=count)

    def _raise_level(self, need: str, *, gaussians: int = 0, chunk_bytes: int = 0) -> None:
        level = find_level(gaussians, chunk_bytes)
        if level <= self._header.level:
            return
        if self._start is None:
            message = (
                f"{need} exceed level {self._header.level} of the stream, which was chosen from "
                "the first frames; the level can be raised only in a new file, so write the "
                "stream to a file instead of a pipe"
            )
            raise EncodeError(message)
        self._header = replace(self._header, level=level)
        end = self._sink.tell()
        self._sink.seek(self._start)
        self._sink.write(self._build_head())
        self._sink.seek(end)

    def _build_head(self) -> bytes:
        head = wire.build_stream_header(self._header)
        return MAGIC + container.build_chunk(container.HEAD, 0, head)


def find_level(gaussians: int, chunk_bytes: int = 0) -> int:
    """Return the lowest level that allows a number of Gaussians and the size of a payload."""
    sufficient_levels = [
        level
        for level, limits in LEVELS.items()
        if gaussians <= limits.gaussians and chunk_bytes <= limits.chunk_bytes
    ]
    return min(sufficient_levels, default=UNLIMITED_LEVEL)


def _find_start(sink: BinaryIO) -> int | None:
    """Return the offset of the stream in a file; None if bytes cannot be written again."""
    if "a" in str(getattr(sink, "mode", "")):
        return None
    with suppress(OSError, AttributeError):  # a sink may have only `write` and `flush`
        if sink.seekable() and not _has_append_flag(sink):
            return sink.tell()
    return None


def _has_append_flag(sink: BinaryIO) -> bool:
    """Return whether writes go to the end of a file, wherever its position is (shell: `>>`)."""
    if sys.platform != "win32":
        import fcntl

        with suppress(OSError, AttributeError):  # the sink is in memory
            return bool(fcntl.fcntl(sink.fileno(), fcntl.F_GETFL) & os.O_APPEND)
    return False
