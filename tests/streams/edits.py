"""Cuts and joins streams in memory, and lists the chunks and digests to compare."""

import io

from quarc_ref.decoder import compute_digest
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.cut import cut
from quarc_ref.streams.decode_stream import decode_states
from quarc_ref.streams.join import join
from quarc_ref.streams.source import as_source


def cut_bytes(data, start=None, stop=None):
    sink = io.BytesIO()
    cut(as_source(data), start, stop, sink)
    return sink.getvalue()


def join_bytes(*streams):
    sink = io.BytesIO()
    join([as_source(stream) for stream in streams], sink)
    return sink.getvalue()


def list_all_chunks(data):
    """Return every chunk of a stream, including chunks of unknown types."""
    reader, chunks = ChunkReader(as_source(data)), []
    while (header := reader.read_header()) is not None:
        chunks.append(reader.take(header))
    return chunks


def list_digests(data):
    """Return the ordinal and the digest of every frame of a completely decoded stream."""
    return [(state.scene.frame, compute_digest(state.scene)) for state in decode_states(data)]
