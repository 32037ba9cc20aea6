"""Reads the chunks of a stream in order: SPEC 5.1.

Decoding and recovery both read chunks with this module, beginning at the start of a stream
or at a seek point. If the header of a chunk is invalid, the chunk is rejected before its
payload is read or memory is allocated for it.
"""

import zlib
from collections.abc import Iterator

from quarc_ref.decoder.limits import check_payload_bytes
from quarc_ref.format import container, wire
from quarc_ref.format.constants import CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, MAGIC
from quarc_ref.format.container import Chunk, ChunkHeader
from quarc_ref.format.errors import (
    BadMagicError,
    BitstreamError,
    SequenceError,
    TrailingDataError,
    TruncatedError,
)
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.source import BytesLike, Source, as_source

_PIECE_BYTES = 1 << 16


class ChunkReader:
    """Reads a stream chunk by chunk.

    A failed read does not move the reader. After a `TruncatedError` in a growing stream, the
    read can be tried again later.

    Args:
        source: The stream.

    Attributes:
        source: The stream.
        offset: Offset of the next chunk.
        sequence: Expected sequence number of the next chunk.
        current_header: Header that was read last; None if it was rejected.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.offset = 0
        self.sequence = 0
        self.current_header: ChunkHeader | None = None
        self._previous_kind = b""
        self._stream_header: StreamHeader | None = None

    @property
    def is_past_tail(self) -> bool:
        """Whether TAIL has been read."""
        return self._previous_kind == container.TAIL

    def read_header(self) -> ChunkHeader | None:
        """Read the header of the next chunk without moving past it.

        Returns:
            The header; None after TAIL.

        Raises:
            ContainerError: The chunk is invalid.
        """
        self.current_header = None
        if self.is_past_tail:
            self._check_end()
            return None
        self._check_magic()
        header = container.parse_header(
            self.source.read(self.offset, CHUNK_HEADER_BYTES), self.offset
        )
        if header.sequence != self.sequence:  # [5.2-4]
            message = f"found chunk {header.sequence} where chunk {self.sequence} was expected"
            raise SequenceError(message, self.offset)
        container.check_type(header, self._stream_header)
        container.check_order(header, self._previous_kind)
        container.check_length(header.length, self._stream_header, self.offset)  # [5.2-6] [13-1]
        self.current_header = header
        return header

    def headers(self) -> Iterator[ChunkHeader]:
        """Yield the chunk headers up to TAIL, without reading the payloads of skipped chunks.

        A chunk is skipped when the next header is read, unless `take` has read the chunk.

        Raises:
            ContainerError: A chunk header is invalid.
        """
        while (header := self.read_header()) is not None:
            yield header
            if self.offset == header.offset:
                self.skip(header)

    def read_chunk(self) -> Chunk | None:
        """Read the next chunk of a known type.

        Chunks of unknown types, which can only be ancillary, are checked and skipped.

        Returns:
            The chunk; None after TAIL.

        Raises:
            ContainerError: The chunk is invalid.
        """
        for header in self.headers():
            if header.kind in container.KNOWN_TYPES:
                return self.take(header)
            check_payload_crc(self.source, header)  # [5.2-10]
        return None

    def take(self, header: ChunkHeader) -> Chunk:
        """Read the chunk of a header that `read_header` returned, and move past it.

        Raises:
            ContainerError: The chunk is invalid.
            LimitError: The payload is too long for this decoder.
        """
        check_payload_bytes(header.length)
        data = self.source.read(header.payload_offset, header.length + CHUNK_CRC_BYTES)
        chunk = container.make_chunk(header, data)
        if header.kind == container.HEAD:
            self._stream_header = _parse_head(chunk)
        self.skip(header)
        return chunk

    def skip(self, header: ChunkHeader) -> None:
        """Move past a chunk without reading its payload."""
        self.offset, self.sequence, self._previous_kind = (
            header.end,
            header.sequence + 1,
            header.kind,
        )

    def seek(self, offset: int, sequence: int) -> None:
        """Move to a chunk whose offset is known; HEAD must have been read."""
        self.offset, self.sequence, self._previous_kind = offset, sequence, b""

    def _check_magic(self) -> None:
        if self.offset:
            return
        start = self.source.read(0, len(MAGIC))
        if not MAGIC.startswith(start):  # [5.1-1]
            message = "not a .quarc stream"
            raise BadMagicError(message, 0)
        if len(start) < len(MAGIC):
            message = "the stream ends inside its magic bytes"
            raise TruncatedError(message, 0)
        self.offset = len(MAGIC)

    def _check_end(self) -> None:
        if self.source.read(self.offset, 1):  # [5.1-5]
            message = "bytes follow TAIL"
            raise TrailingDataError(message, self.offset)


def check_payload_crc(source: Source, header: ChunkHeader) -> None:
    """Check the CRC of a payload piece by piece, without storing the payload.

    Raises:
        TruncatedError: The stream ends inside the chunk.
        PayloadCrcError: The payload does not match its CRC.
    """
    crc, offset, end = 0, header.payload_offset, header.end - CHUNK_CRC_BYTES
    while offset < end:
        piece = source.read(offset, min(_PIECE_BYTES, end - offset))
        if not piece:
            container.verify_payload(header, crc, b"")
        crc, offset = zlib.crc32(piece, crc), offset + len(piece)
    container.verify_payload(header, crc, source.read(end, CHUNK_CRC_BYTES))


def split_chunks(stream: BytesLike | Source) -> Iterator[Chunk]:
    """Yield the chunks of a stream after checking their CRCs.

    Ancillary chunks of unknown types are checked and skipped.

    Args:
        stream: A stream, which may be incomplete.

    Yields:
        The chunks in stream order, from HEAD to TAIL.

    Raises:
        ContainerError: A chunk is invalid (SPEC 5); all chunks before it have been yielded.
    """
    reader = ChunkReader(as_source(stream))
    while (chunk := reader.read_chunk()) is not None:
        yield chunk


def _parse_head(chunk: Chunk) -> StreamHeader:
    try:
        return wire.parse_stream_header(chunk.payload)
    except BitstreamError as error:
        error.offset = chunk.offset
        raise
