"""The way to a frame without what lies before it: SPEC 11.2.

Through INDX where a stream has one; else from chunk header to chunk header.
Neither is trusted: the decoder holds the CANO chunk that is come to against
what led there.
"""

from contextlib import suppress

from quarc_ref.format import container, wire
from quarc_ref.format.chunk_reader import ChunkReader
from quarc_ref.format.constants import CHUNK_HEADER_BYTES
from quarc_ref.format.container import TAIL_CHUNK_BYTES, Chunk, ChunkHeader
from quarc_ref.format.errors import BitstreamError, FieldError, IndexMismatchError, TruncatedError
from quarc_ref.format.records import SeekPoint
from quarc_ref.format.seek_points import SeekPoints
from quarc_ref.format.source import Source

_FRAME_BYTES = 4


def seek(reader: ChunkReader, frame: int) -> SeekPoints:
    """Move a reader to the last canonical frame that is not after a frame.

    Args:
        reader: Has read HEAD.
        frame: Ordinal of the frame that is wanted.

    Returns:
        All seek points up to the one that the reader is at; none where the
        reader stays: the source goes forward only, or has no such frame yet.

    Raises:
        BitstreamError: What is wrong with the bytes that were read.
    """
    size, here = reader.source.size(), (reader.offset, reader.sequence)
    if size is None:
        return SeekPoints.of(())
    points = _read_index(reader, size)
    if points is None:
        reader.seek(*here)
        points = _walk_headers(reader, frame)
    points = points.until(frame)
    if not points:
        reader.seek(*here)
        return points
    _go_to(reader, points[-1].offset, points[-1].sequence, container.CANO)
    return points


def _read_index(reader: ChunkReader, size: int) -> SeekPoints | None:
    """Return the entries of INDX; None in a stream without, or without its end yet."""
    tail_offset = size - TAIL_CHUNK_BYTES
    chunk = read_tail_chunk(reader.source, size)
    if chunk is None:
        return None
    tail = wire.parse_tail(chunk.payload)
    if tail.index_offset == 0:
        return None
    _go_to(reader, tail.index_offset, chunk.sequence - 1, container.INDX)
    index = reader.read_chunk()
    if index is None or reader.offset != tail_offset:
        message = "INDX does not end where TAIL begins"
        raise IndexMismatchError(message, tail.index_offset)
    points = wire.parse_index(index.payload)
    if len(points) != tail.canonical_count:
        message = f"{len(points)} seek points of {tail.canonical_count} canonical frames"
        raise IndexMismatchError(message, tail.index_offset)
    return points


def read_tail_chunk(source: Source, size: int) -> Chunk | None:
    """Return the TAIL chunk at the end of a stream; None where there is none that is proved."""
    offset = size - TAIL_CHUNK_BYTES
    with suppress(BitstreamError):
        data = source.read(max(0, offset), TAIL_CHUNK_BYTES)
        header = container.parse_header(data[:CHUNK_HEADER_BYTES], offset)
        if header.kind == container.TAIL and header.end == offset + TAIL_CHUNK_BYTES:
            return container.take_payload(header, data[CHUNK_HEADER_BYTES:])
    return None


def _walk_headers(reader: ChunkReader, frame: int) -> SeekPoints:
    """Return the seek points up to a frame, from chunk header to chunk header."""
    points, due = [], 0
    with suppress(TruncatedError):
        while due <= frame and (header := reader.read_header()) is not None:
            if header.kind == container.CANO:
                due = _read_ordinal(reader, header)
                points.append(SeekPoint(header.offset, header.sequence, due))
            due += header.kind in (container.CANO, container.FRAM)
            reader.skip(header)
    return SeekPoints.of(points)


def _read_ordinal(reader: ChunkReader, header: ChunkHeader) -> int:
    if header.length < _FRAME_BYTES:
        message = f"a payload of {header.length} bytes has no ordinal"
        raise FieldError(message, header.offset)
    data = reader.source.read(header.payload_offset, _FRAME_BYTES)
    if len(data) < _FRAME_BYTES:
        message = "the stream ends inside a chunk"
        raise TruncatedError(message, header.offset)
    return int.from_bytes(data, "little")


def _go_to(reader: ChunkReader, offset: int, sequence: int, kind: bytes) -> None:
    """Move a reader to a chunk, and see that it is there."""
    reader.seek(offset, sequence)
    try:
        header = reader.read_header()
    except BitstreamError as error:
        message = f"no chunk {sequence} where the stream says: {error}"
        raise IndexMismatchError(message, offset) from error
    if header is None or header.kind != kind:
        message = f"chunk {sequence} is no {kind.decode()}"
        raise IndexMismatchError(message, offset)
