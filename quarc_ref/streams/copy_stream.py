"""Copies a stream unchanged, and checks the CRCs of every chunk."""

from typing import BinaryIO

from quarc_ref.format import container
from quarc_ref.format.constants import MAGIC
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.source import Source


def copy_stream(source: Source, sink: BinaryIO) -> int:
    """Copy a whole stream; the CRCs of each chunk are checked before it is written.

    Args:
        source: A stream, which may be a pipe.
        sink: Binary file for the copy.

    Returns:
        Number of frames in the stream.

    Raises:
        BitstreamError: The stream is invalid; all chunks before the error have been copied.
        SourceError: The file, pipe or server cannot be read.
    """
    reader, frame_count = ChunkReader(source), 0
    for header in reader.headers():
        chunk = reader.take(header)
        if chunk.kind == container.HEAD:
            sink.write(MAGIC)
        # The file may have changed since the check, so it is not read again.
        sink.write(container.build_chunk(chunk.kind, chunk.sequence, chunk.payload))
        frame_count += header.kind in container.FRAME_TYPES
    return frame_count
