"""Chunks in a file: SPEC 5.1 and 5.2.

Every chunk names its length and proves its header and its payload by a CRC, so
that nothing is parsed, let alone entropy-decoded, before it is known whole.
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from quarc_ref.format import wire
from quarc_ref.format.constants import CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, MAGIC, SYNC
from quarc_ref.format.errors import (
    BadChunkTypeError,
    BadMagicError,
    BadSyncError,
    ChunkOrderError,
    HeaderCrcError,
    PayloadCrcError,
    SequenceError,
    TrailingDataError,
    TruncatedError,
    UnknownCriticalError,
)

HEAD = b"HEAD"
CANO = b"CANO"
FRAM = b"FRAM"
TAIL = b"TAIL"
CAME = b"came"
META = b"meta"
_CRITICAL = (HEAD, CANO, FRAM, TAIL)
_ANCILLARY_BIT = 0x20


@dataclass(frozen=True, slots=True)
class Chunk:
    """A chunk whose CRCs hold.

    Attributes:
        kind: Its type, four letters.
        payload: What it holds.
        offset: Where it begins in the stream, bytes.
    """

    kind: bytes
    payload: bytes
    offset: int

    def byte_count(self) -> int:
        """Return the size of the chunk in the stream."""
        return CHUNK_HEADER_BYTES + len(self.payload) + CHUNK_CRC_BYTES


def build_chunk(kind: bytes, sequence: int, payload: bytes) -> bytes:
    """Frame a payload (SPEC 5.2).

    Args:
        kind: Type of the chunk, four letters.
        sequence: Ordinal of the chunk in the stream.
        payload: What it holds.
    """
    unproved = wire.build_chunk_header(kind, sequence, len(payload), 0)[:-CHUNK_CRC_BYTES]
    header = wire.build_chunk_header(kind, sequence, len(payload), zlib.crc32(unproved))
    return header + payload + zlib.crc32(payload).to_bytes(CHUNK_CRC_BYTES, "little")


def split_chunks(data: bytes) -> Iterator[Chunk]:
    """Walk the chunks of a stream, each proved before it is given out.

    Chunks that a reader may skip are given out too; it is told them by type.

    Args:
        data: A whole stream, or what there is of it.

    Yields:
        HEAD first, TAIL last.

    Raises:
        ContainerError: At the first byte that is not as SPEC 5 has it; every
            chunk before it has been given out.
    """
    if data[: len(MAGIC)] != MAGIC[: len(data)]:
        message = "this is no .quarc stream"
        raise BadMagicError(message, 0)
    offset, sequence, kind = len(MAGIC), 0, b""
    while kind != TAIL:
        chunk = _read_chunk(data, offset, sequence)
        _check_order(chunk, sequence)
        yield chunk
        offset, sequence, kind = offset + chunk.byte_count(), sequence + 1, chunk.kind
    if offset != len(data):
        message = f"{len(data) - offset} bytes follow TAIL"
        raise TrailingDataError(message, offset)


def _read_chunk(data: bytes, offset: int, sequence: int) -> Chunk:
    header = data[offset : offset + CHUNK_HEADER_BYTES]
    if not SYNC.startswith(header[: len(SYNC)]) and header[: len(SYNC)] != SYNC:
        message = "a chunk must begin here"
        raise BadSyncError(message, offset)
    if len(header) < CHUNK_HEADER_BYTES:
        message = "the stream ends before its TAIL chunk"
        raise TruncatedError(message, offset)
    kind, number, length, header_crc = wire.parse_chunk_header(header)
    if zlib.crc32(header[:-CHUNK_CRC_BYTES]) != header_crc:
        message = "the chunk's header is damaged"
        raise HeaderCrcError(message, offset)
    if number != sequence:
        message = f"chunk {number} stands where chunk {sequence} is due"
        raise SequenceError(message, offset)
    return Chunk(kind, _read_payload(data, offset + CHUNK_HEADER_BYTES, length), offset)


def _read_payload(data: bytes, start: int, length: int) -> bytes:
    end = start + length
    stored = data[end : end + CHUNK_CRC_BYTES]
    if len(stored) < CHUNK_CRC_BYTES:
        message = "the stream ends inside a chunk"
        raise TruncatedError(message, start - CHUNK_HEADER_BYTES)
    payload = data[start:end]
    if zlib.crc32(payload) != int.from_bytes(stored, "little"):
        message = "the chunk's payload is damaged"
        raise PayloadCrcError(message, start - CHUNK_HEADER_BYTES)
    return payload


def _check_order(chunk: Chunk, sequence: int) -> None:
    if not _is_type(chunk.kind):
        message = f"{chunk.kind!r} is no chunk type"
        raise BadChunkTypeError(message, chunk.offset)
    if (chunk.kind == HEAD) != (sequence == 0):
        message = "HEAD must be the first chunk, and no other"
        raise ChunkOrderError(message, chunk.offset)
    if chunk.kind not in _CRITICAL and not chunk.kind[0] & _ANCILLARY_BIT:
        message = f"critical chunk {chunk.kind.decode()} is unknown"
        raise UnknownCriticalError(message, chunk.offset)


def _is_type(kind: bytes) -> bool:
    """Tell whether the letters keep to the patterns of SPEC 5.2.

    All letters have the case of the first (upper: critical), but the second,
    whose other case marks a private type.
    """
    return kind.isalpha() and len({letter & _ANCILLARY_BIT for letter in (kind[0], *kind[2:])}) == 1
