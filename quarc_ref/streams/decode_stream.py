"""Decodes streams to scenes: SPEC 7.

`ChunkReader` checks the chunks and their order, `StreamDecoder` stores the state of the
stream, and an engine computes the state of each frame.
"""

from collections.abc import Iterator

from quarc_ref.decoder.engine import FrameState
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import container
from quarc_ref.format.container import Chunk
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.follow import Follow, poll
from quarc_ref.streams.seek import seek
from quarc_ref.streams.source import BytesLike, Source, as_source


def decode(
    stream: BytesLike | Source,
    start: int = 0,
    stop: int | None = None,
    follow: Follow | None = None,
    decoder: StreamDecoder | None = None,
) -> Iterator[Scene]:
    """Decode the frames of a stream.

    Args:
        stream: A stream; if it is truncated, its complete frames are yielded before the error.
        start: Ordinal of the first frame; only the bytes needed to reach it are read (SPEC 11.2).
        stop: Ordinal of the frame before which decoding stops; None to decode all later frames.
        follow: How to wait for a growing stream; None to stop at the stream's current end.
        decoder: A new decoder, from which the caller can read the cameras and metadata;
            None to create one.

    Yields:
        The scene of every requested frame, in order.

    Raises:
        BitstreamError: The stream is invalid; all frames before the error have been yielded.
        LimitError: A stream at the unlimited level exceeds the limits of this decoder.
        SourceError: The file, pipe or server cannot be read.
    """
    for state in decode_states(stream, start, stop, follow, decoder):
        yield state.scene


def decode_states(
    stream: BytesLike | Source,
    start: int = 0,
    stop: int | None = None,
    follow: Follow | None = None,
    decoder: StreamDecoder | None = None,
) -> Iterator[FrameState]:
    """Decode the frames of a stream as complete states; see `decode`."""
    for _, state in walk_frames(stream, decoder or StreamDecoder(), start, stop, follow):
        frame = state.frame
        if start <= frame and (stop is None or frame < stop):
            yield state


def walk_frames(
    stream: BytesLike | Source,
    decoder: StreamDecoder,
    start: int = 0,
    stop: int | None = None,
    follow: Follow | None = None,
) -> Iterator[tuple[Chunk, FrameState]]:
    """Decode frames, including those between the seek point and the first requested frame.

    Args:
        stream: See `decode`.
        decoder: A new decoder.
        start: See `decode`.
        stop: See `decode`; the first decoded frame is yielded even if it is after `stop`.
        follow: See `decode`.

    Yields:
        The chunk and the state of every decoded frame.
    """
    reader = ChunkReader(as_source(stream))
    while (chunk := poll(reader.read_chunk, follow)) is not None:
        state = decoder.push(chunk)
        if chunk.kind == container.HEAD and start > 0:
            decoder.skip_to(*seek(reader, start))
        if state is None:
            continue
        yield chunk, state
        if stop is not None and state.frame + 1 >= stop:
            return
