"""Seeks to a frame without decoding the frames before it: SPEC 11.2.

The seek points are read from INDX, or from the chunk headers if the stream has no INDX. The
decoder checks that the chunk at a seek point is the expected chunk. If the
frame is a snapshot, the CANO to which it refers is read, too.
"""

from contextlib import suppress

from quarc_ref.format import container, wire
from quarc_ref.format.constants import CHUNK_HEADER_BYTES
from quarc_ref.format.container import TAIL_CHUNK_BYTES, Chunk, ChunkHeader
from quarc_ref.format.errors import BitstreamError, IndexMismatchError, TruncatedError
from quarc_ref.format.records import SeekPoint
from quarc_ref.format.seek_points import SeekPoints
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.resync import ORDINAL_BYTES, read_ordinals
from quarc_ref.streams.source import Source


def seek(reader: ChunkReader, frame: int) -> tuple[SeekPoints, Chunk | None]:
    """Move a reader to the last seek point at or before a frame.

    Args:
        reader: Reader that has read HEAD.
        frame: Ordinal of the requested frame.

    Returns:
        All seek points up to the reader's new position and, if the chunk at this position is a
        snapshot, the CANO to which it refers (otherwise None). There are no seek points if the
        reader has not moved, because the source is forward-only or does not have the frame yet.

    Raises:
        BitstreamError: The index or a chunk that is read is invalid.
    """
    size, initial_position = reader.source.size(), (reader.offset, reader.sequence)
    if size is None:
        return SeekPoints.from_records(()), None
    points = _read_index(reader, size)
    if points is None:
        reader.seek(*initial_position)
        points = _collect_seek_points(reader, frame)
    points = points.up_to_frame(frame)
    if not points:
        reader.seek(*initial_position)
        return points, None
    header = _move_to_chunk(
        reader, points[-1].offset, points[-1].sequence, *container.CANONICAL_TYPES
    )
    canonical = None
    if header.kind == container.SNAP:
        canonical = _read_canonical(reader, header, points)
        reader.seek(header.offset, header.sequence)
    return points, canonical


def _read_canonical(reader: ChunkReader, header: ChunkHeader, points: SeekPoints) -> Chunk:
    """Read the CANO to which a snapshot refers."""
    point = points.find_by_frame(_read_ordinal(reader, header, ORDINAL_BYTES))  # [11.2-5]
    if point is None:
        message = "the frame that a snapshot is coded against has no seek point"
        raise IndexMismatchError(message, header.offset)
    return reader.take(_move_to_chunk(reader, point.offset, point.sequence, container.CANO))


def _read_index(reader: ChunkReader, size: int) -> SeekPoints | None:
    """Read INDX; return None if the stream has no INDX or is incomplete."""
    tail_offset = size - TAIL_CHUNK_BYTES
    chunk = read_tail_chunk(reader.source, size)
    if chunk is None:
        return None
    tail = wire.parse_tail(chunk.payload)
    if tail.index_offset == 0:
        return None
    _move_to_chunk(reader, tail.index_offset, chunk.sequence - 1, container.INDX)
    index = reader.read_chunk()
    if index is None or reader.offset != tail_offset:
        message = "INDX does not end where TAIL begins"
        raise IndexMismatchError(message, tail.index_offset)
    points = wire.parse_index(index.payload)
    if len(points) != tail.canonical_count:  # [11.2-3]
        message = f"INDX has {len(points)} seek points, but TAIL states {tail.canonical_count}"
        raise IndexMismatchError(message, tail.index_offset)
    return points


def read_tail_chunk(source: Source, size: int) -> Chunk | None:
    """Read the TAIL chunk at the end of a stream; return None if it is missing or invalid."""
    offset = size - TAIL_CHUNK_BYTES
    with suppress(BitstreamError):
        data = source.read(max(0, offset), TAIL_CHUNK_BYTES)
        header = container.parse_header(data[:CHUNK_HEADER_BYTES], offset)
        if header.kind == container.TAIL and header.end == offset + TAIL_CHUNK_BYTES:
            return container.make_chunk(header, data[CHUNK_HEADER_BYTES:])
    return None


def _collect_seek_points(reader: ChunkReader, frame: int) -> SeekPoints:
    """Collect the seek points up to a frame from the chunk headers."""
    points, next_frame = [], 0
    with suppress(TruncatedError):
        for header in reader.headers():
            if header.kind in container.CANONICAL_TYPES:
                next_frame = _read_ordinal(reader, header, 0)
                if header.kind == container.SNAP and header.length >= 2 * ORDINAL_BYTES:
                    _read_ordinal(reader, header, ORDINAL_BYTES)  # may not have arrived yet
                points.append(SeekPoint(header.offset, header.sequence, next_frame))
            next_frame += header.kind in container.FRAME_TYPES
            if next_frame > frame:
                break
    return SeekPoints.from_records(points)


def _read_ordinal(reader: ChunkReader, header: ChunkHeader, offset: int) -> int:
    """Read the frame number at byte `offset` of a payload."""
    return read_ordinals(reader.source, header, 1 + offset // ORDINAL_BYTES)[-1]


def _move_to_chunk(reader: ChunkReader, offset: int, sequence: int, *kinds: bytes) -> ChunkHeader:
    """Move a reader to a chunk, and check that it exists and has one of the types `kinds`."""
    reader.seek(offset, sequence)
    try:
        header = reader.read_header()
    except BitstreamError as error:
        message = f"chunk {sequence} is not at the offset that the index states: {error}"
        raise IndexMismatchError(message, offset) from error
    if header is None or header.kind not in kinds:  # [11.2-2]
        message = f"chunk {sequence} is not a {kinds[0].decode()}"
        raise IndexMismatchError(message, offset)
    return header
