"""Writes streams chunk by chunk: SPEC 5.1, 5.8, 5.9.

The counterpart of `chunk_reader`: manages sequence numbers, seek points and totals, while
the caller provides payloads.
"""

from collections.abc import Callable
from typing import BinaryIO

from quarc_ref.format import container, wire
from quarc_ref.format.constants import MAGIC
from quarc_ref.format.container import Chunk, build_chunk
from quarc_ref.format.records import SeekPoint, Tail
from quarc_ref.streams.resync import canonical_frame


class StreamWriter:
    """Appends complete chunks to a sink.

    Args:
        sink: Binary file to which the stream is appended. It is flushed after every
            chunk, so that readers can follow the stream.
        head: Payload of HEAD, which is written on construction.
        check: Called with every chunk before it is written; if it raises, nothing is written.
        held: Number of bytes of the stream that the sink already has; chunks within them
            are counted but not written.

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
        held: int = 0,
    ) -> None:
        self.offset = len(MAGIC)
        self.sequence = 0
        self.frame_count = 0
        self._sink = sink
        self._check = check
        self._held = held
        self._limits = wire.parse_stream_header(head).limits
        self._points: list[SeekPoint] = []
        self._append(container.HEAD, head, MAGIC)

    def write(self, kind: bytes, payload: bytes) -> None:
        """Append a chunk.

        Args:
            kind: Type of the chunk: any except HEAD, INDX and TAIL.
            payload: Payload, within the limit of the stream's level.
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

    def _append(self, kind: bytes, payload: bytes, before: bytes = b"") -> None:
        data = before + build_chunk(kind, self.sequence, payload)
        if self._check is not None:
            self._check(Chunk(kind, payload, self.offset, self.sequence))
        if self.offset >= self._held:
            self._sink.write(data)
            self._sink.flush()
        if kind in container.CANONICAL_TYPES:
            self._points.append(SeekPoint(self.offset, self.sequence, canonical_frame(payload)))
        self.frame_count += kind in container.FRAME_TYPES
        self.offset += len(data) - len(before)
        self.sequence += 1
