"""Writes streams chunk by chunk: SPEC 5.1, 5.8, 5.9.

`StreamWriter`, the counterpart of `ChunkReader`, manages sequence numbers, seek points and
totals; the caller provides the payloads.
"""

from collections.abc import Callable
from typing import BinaryIO

from quarc_ref.format import container, wire
from quarc_ref.format.constants import MAGIC
from quarc_ref.format.container import Chunk, build_chunk
from quarc_ref.format.records import SeekPoint, Tail
from quarc_ref.streams.resync import parse_ordinal


class StreamWriter:
    """Appends complete chunks to a sink.

    Args:
        sink: Binary file to which the stream is appended. It is flushed after every
            chunk, so that readers can follow the stream.
        head: Payload of HEAD, which the constructor writes.
        check: Function called with every chunk before the chunk is written; if it raises, the
            chunk is not written.
        existing_bytes: Number of bytes of the stream that the sink already contains; the chunks
            in these bytes are counted but not written.

    Attributes:
        offset: Offset of the next chunk.
        sequence: Sequence number of the next chunk.
        frame_count: Number of frames written.
    """

    def __init__(
        self,
        sink: BinaryIO,
        head: bytes,
        check: Callable[[Chunk], object] | None = None,
        existing_bytes: int = 0,
    ) -> None:
        self.offset = len(MAGIC)
        self.sequence = 0
        self.frame_count = 0
        self._sink = sink
        self._check = check
        self._existing_bytes = existing_bytes
        self._limits = wire.parse_stream_header(head).limits
        self._points: list[SeekPoint] = []
        self._append(container.HEAD, head, MAGIC)

    def write(self, kind: bytes, payload: bytes) -> None:
        """Append a chunk.

        Args:
            kind: Type of the chunk: any except HEAD, INDX and TAIL.
            payload: Content of the chunk, at most as long as the stream's level allows.
        """
        self._append(kind, payload)

    def finish(self) -> None:
        """Write INDX and TAIL; INDX is omitted if it is longer than the stream's level allows."""
        index, index_offset = wire.build_index(self._points), 0
        if len(index) <= self._limits.chunk_bytes:
            index_offset = self.offset
            self._append(container.INDX, index)
        tail = Tail(self.frame_count, len(self._points), index_offset)
        self._append(container.TAIL, wire.build_tail(tail))

    def _append(self, kind: bytes, payload: bytes, prefix: bytes = b"") -> None:
        data = prefix + build_chunk(kind, self.sequence, payload)
        if self._check is not None:
            self._check(Chunk(kind, payload, self.offset, self.sequence))
        if self.offset >= self._existing_bytes:
            self._sink.write(data)
            self._sink.flush()
        if kind in container.CANONICAL_TYPES:
            self._points.append(SeekPoint(self.offset, self.sequence, parse_ordinal(payload)))
        self.frame_count += kind in container.FRAME_TYPES
        self.offset += len(data) - len(prefix)
        self.sequence += 1
