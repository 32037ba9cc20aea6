"""Parses and builds chunks, and checks their framing: SPEC 5.1 and 5.2.

Every chunk contains its length and two CRCs, one of its header and one of its payload. A
payload is parsed only if its CRC matches.
"""

import zlib
from dataclasses import dataclass

from quarc_ref.format import wire
from quarc_ref.format.constants import (
    CHUNK_CRC_BYTES,
    CHUNK_HEADER_BYTES,
    HEAD_BYTES_LIMIT,
    SYNC,
    TAIL_BYTES,
)
from quarc_ref.format.errors import (
    BadChunkTypeError,
    BadSyncError,
    ChunkOrderError,
    ChunkSizeError,
    HeaderCrcError,
    PayloadCrcError,
    TruncatedError,
    UnknownCriticalError,
)
from quarc_ref.format.records import StreamHeader

HEAD = b"HEAD"
CANO = b"CANO"
FRAM = b"FRAM"
SNAP = b"SNAP"
INDX = b"INDX"
TAIL = b"TAIL"
CAME = b"came"
META = b"meta"
KNOWN_TYPES = (HEAD, CANO, FRAM, SNAP, INDX, TAIL, CAME, META)
CANONICAL_TYPES = (CANO, SNAP)  # random access points
FRAME_TYPES = (CANO, SNAP, FRAM)
TAIL_CHUNK_BYTES = CHUNK_HEADER_BYTES + TAIL_BYTES + CHUNK_CRC_BYTES
_ANCILLARY_BIT = 0x20


@dataclass(frozen=True, slots=True)
class ChunkHeader:
    """The header of a chunk.

    Attributes:
        kind: Type of the chunk, four letters.
        sequence: Ordinal of the chunk in the stream.
        length: Size of the payload, bytes.
        offset: Offset of the chunk in the stream.
    """

    kind: bytes
    sequence: int
    length: int
    offset: int

    @property
    def payload_offset(self) -> int:
        """Offset of the payload in the stream."""
        return self.offset + CHUNK_HEADER_BYTES

    @property
    def end(self) -> int:
        """Offset of the first byte after the chunk."""
        return self.payload_offset + self.length + CHUNK_CRC_BYTES

    @property
    def is_ancillary(self) -> bool:
        """Whether decoders may ignore the chunk."""
        return bool(self.kind[0] & _ANCILLARY_BIT)


@dataclass(frozen=True, slots=True)
class Chunk:
    """A chunk with valid CRCs.

    Attributes:
        kind: Type of the chunk, four letters.
        payload: Content of the chunk.
        offset: Offset of the chunk in the stream, bytes.
        sequence: Ordinal of the chunk in the stream.
    """

    kind: bytes
    payload: bytes
    offset: int
    sequence: int

    def byte_count(self) -> int:
        """Return the size of the chunk in the stream, bytes."""
        return CHUNK_HEADER_BYTES + len(self.payload) + CHUNK_CRC_BYTES


def build_chunk(kind: bytes, sequence: int, payload: bytes) -> bytes:
    """Return the bytes of a chunk with the given payload (SPEC 5.2).

    Args:
        kind: Type of the chunk, four letters.
        sequence: Ordinal of the chunk in the stream.
        payload: Content of the chunk.
    """
    header_fields = wire.build_chunk_header(kind, sequence, len(payload), 0)[:-CHUNK_CRC_BYTES]
    header = wire.build_chunk_header(kind, sequence, len(payload), zlib.crc32(header_fields))
    return header + payload + zlib.crc32(payload).to_bytes(CHUNK_CRC_BYTES, "little")


def parse_header(data: bytes, offset: int) -> ChunkHeader:
    """Parse the header of a chunk and check its CRC (SPEC 5.2).

    Args:
        data: 20 bytes, or fewer at the end of the stream.
        offset: Offset of `data` in the stream.

    Raises:
        BadSyncError: The bytes do not start with the sync word.
        TruncatedError: The header is incomplete.
        HeaderCrcError: The header does not match its CRC.
    """
    if not data.startswith(SYNC[: len(data)]):  # [5.2-1]
        message = "a chunk must begin here"
        raise BadSyncError(message, offset)
    if len(data) < CHUNK_HEADER_BYTES:  # [5.1-4]
        message = "the stream ends before its TAIL chunk"
        raise TruncatedError(message, offset)
    if not is_header_crc_valid(data):  # [5.2-2] [5.2-5]
        message = "the chunk's header is damaged"
        raise HeaderCrcError(message, offset)
    kind, sequence, length, _ = wire.parse_chunk_header(data)
    return ChunkHeader(kind, sequence, length, offset)


def is_header_crc_valid(data: bytes) -> bool:
    """Return whether the 20 bytes of a header match their CRC."""
    stored = int.from_bytes(data[-CHUNK_CRC_BYTES:], "little")
    return zlib.crc32(data[:-CHUNK_CRC_BYTES]) == stored


def verify_payload(header: ChunkHeader, crc: int, stored_crc: bytes) -> None:
    """Compare the CRC of a payload with the stored CRC.

    Raises:
        TruncatedError: The stream ends before the CRC.
        PayloadCrcError: The CRC does not match.
    """
    if len(stored_crc) < CHUNK_CRC_BYTES:
        message = "the stream ends inside a chunk"
        raise TruncatedError(message, header.offset)
    if crc != int.from_bytes(stored_crc, "little"):  # [5.2-3]
        message = "the chunk's payload is damaged"
        raise PayloadCrcError(message, header.offset)


def make_chunk(header: ChunkHeader, data: bytes) -> Chunk:
    """Make a chunk, after checking its payload against its CRC.

    Args:
        header: Header of the chunk.
        data: Bytes from the start of the payload to the end of the chunk, or fewer if the
            stream ends earlier.

    Raises:
        TruncatedError: The stream ends inside the chunk.
        PayloadCrcError: The payload does not match its CRC.
    """
    payload = data[: header.length]
    verify_payload(header, zlib.crc32(payload), data[header.length :])
    return Chunk(header.kind, payload, header.offset, header.sequence)


def check_type(header: ChunkHeader, stream_header: StreamHeader | None) -> None:
    """Reject a chunk with an invalid or unknown type (SPEC 5.2).

    Args:
        header: Header of the chunk.
        stream_header: Header of the stream; None before HEAD.

    Raises:
        BadChunkTypeError: The type does not match the patterns of SPEC 5.2.
        UnknownCriticalError: The type is critical and unknown to this version.
    """
    if not _matches_type_pattern(header.kind):  # [5.2-8]
        message = f"{header.kind!r} is not a chunk type"
        raise BadChunkTypeError(message, header.offset)
    is_known = header.kind in KNOWN_TYPES
    if header.kind == SNAP:
        is_known = stream_header is not None and stream_header.snapshots
    if not is_known and not header.is_ancillary:  # [5.2-9]
        message = f"critical chunk {header.kind.decode()} is unknown"
        raise UnknownCriticalError(message, header.offset)


def check_order(header: ChunkHeader, previous_kind: bytes) -> None:
    """Reject a chunk whose type is not allowed at its position (SPEC 5.1).

    Args:
        header: Header of the chunk.
        previous_kind: Type of the previous chunk; empty if unknown.

    Raises:
        ChunkOrderError: HEAD is not first or is repeated, or INDX is not followed by TAIL.
    """
    if (header.kind == HEAD) != (header.sequence == 0):  # [5.1-2]
        message = "the first chunk must be HEAD, and no other chunk may be HEAD"
        raise ChunkOrderError(message, header.offset)
    if previous_kind == INDX and header.kind != TAIL:  # [5.1-6]
        message = "TAIL must follow INDX"
        raise ChunkOrderError(message, header.offset)


def check_length(length: int, stream_header: StreamHeader | None, offset: int) -> None:
    """Reject a payload that is longer than the stream's level allows (SPEC 3.2).

    Args:
        length: Size of the payload, bytes.
        stream_header: Header of the stream; None for HEAD itself (SPEC 5.3).
        offset: Offset of the chunk.

    Raises:
        ChunkSizeError: The payload is longer than allowed.
    """
    limit = HEAD_BYTES_LIMIT if stream_header is None else stream_header.limits.chunk_bytes
    if length > limit:  # [3.2-4] [5.2-7]
        message = f"a payload of {length} bytes exceeds the limit of {limit}"
        raise ChunkSizeError(message, offset)


def _matches_type_pattern(kind: bytes) -> bool:
    """Return whether a chunk type matches the patterns of SPEC 5.2.

    The first, third and fourth letters have the same case: upper case in a critical type,
    lower case in an ancillary type. In a private type, the second letter has the opposite case.
    """
    return kind.isalpha() and len({letter & _ANCILLARY_BIT for letter in (kind[0], *kind[2:])}) == 1
