"""Visits the chunks of a stream by reading their headers, and numbers the frames.

Payloads are read and checked only on request. If a chunk is skipped, only its header is
read, but its payload must be complete.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

from quarc_ref.format import container, wire
from quarc_ref.format.container import Chunk, ChunkHeader
from quarc_ref.format.errors import ChunkOrderError, FrameOrderError, TruncatedError
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.resync import read_ordinals
from quarc_ref.streams.source import Source


@dataclass(frozen=True, slots=True)
class Step:
    """A chunk that a walk visits.

    Attributes:
        header: Header of the chunk.
        frame: Ordinal of the chunk's frame, or of the previous frame if the chunk is not a
            frame; None before the first frame.
    """

    header: ChunkHeader
    frame: int | None

    @property
    def is_canonical(self) -> bool:
        """Whether the chunk is a canonical frame (CANO or SNAP)."""
        return self.header.kind in container.CANONICAL_TYPES

    @property
    def is_frame(self) -> bool:
        """Whether the chunk is a frame."""
        return self.header.kind in container.FRAME_TYPES


class FrameWalk:
    """Visits the chunks of a stream in order. The constructor reads HEAD.

    Args:
        source: The stream.

    Attributes:
        head: Payload of HEAD.
        header: The parsed payload of HEAD.

    Raises:
        BitstreamError: HEAD is invalid.
    """

    def __init__(self, source: Source) -> None:
        self._reader = ChunkReader(source)
        chunk = self._reader.read_chunk()
        self.head = chunk.payload if chunk else b""
        self.header = wire.parse_stream_header(self.head)
        self._canonical: int | None = None  # ordinal of the last CANO
        self._is_chunk_read = False
        self._available_bytes: int | None = 0  # minimum number of available bytes; None if unknown

    def __iter__(self) -> Iterator[Step]:
        """Yield every chunk after HEAD, except INDX and TAIL.

        Raises:
            BitstreamError: A chunk that is visited is invalid.
        """
        frame: int | None = None
        for header in self._reader.headers():
            frame = self._next_frame(header, frame)
            self._is_chunk_read = False
            step = Step(header, frame)
            if header.kind in (container.INDX, container.TAIL):
                self.take(step)  # checks the CRC, so that a damaged TAIL is rejected
            else:
                yield step
            if not self._is_chunk_read:
                self._skip_chunk(header)

    @property
    def offset(self) -> int:
        """Offset up to which the walk has moved past chunks, which are therefore complete."""
        return self._reader.offset

    def take(self, step: Step) -> Chunk:
        """Read and check the chunk of the current step."""
        self._is_chunk_read = True
        return self._reader.take(step.header)

    def _skip_chunk(self, header: ChunkHeader) -> None:
        """Skip a chunk, after checking that the stream is large enough to contain it."""
        if self._available_bytes is not None and header.end > self._available_bytes:
            self._available_bytes = self._reader.source.size()
            if self._available_bytes is not None and header.end > self._available_bytes:
                _raise_truncated(header)
        self._reader.skip(header)

    def _next_frame(self, header: ChunkHeader, frame: int | None) -> int | None:
        if header.kind in container.CANONICAL_TYPES:
            return self._next_canonical(header, frame)
        if header.kind != container.FRAM:
            return frame
        if frame is None:
            message = "a frame must follow a canonical frame"
            raise ChunkOrderError(message, header.offset)
        return frame + 1

    def _next_canonical(self, header: ChunkHeader, frame: int | None) -> int:
        """Return the ordinal of a CANO or SNAP, after checking it and the SNAP's reference."""
        is_snapshot = header.kind == container.SNAP
        if is_snapshot and self._canonical is None:  # [5.1-3]
            message = "a snapshot must follow a CANO"
            raise ChunkOrderError(message, header.offset)
        ordinal, *references = read_ordinals(self._reader.source, header, 1 + is_snapshot)
        if frame is not None and ordinal != frame + 1:  # [7.2-1] [7.9-1]
            message = f"frame {ordinal} follows frame {frame}; expected frame {frame + 1}"
            raise FrameOrderError(message, header.offset)
        if not is_snapshot:
            self._canonical = ordinal
        elif references != [self._canonical]:  # [7.9-2]
            message = f"frame {ordinal} is coded against frame {references[0]}, "
            message += f"but the last CANO is frame {self._canonical}"
            raise FrameOrderError(message, header.offset)
        return ordinal


def _raise_truncated(header: ChunkHeader) -> NoReturn:
    message = "the stream ends inside a chunk"
    raise TruncatedError(message, header.offset)
