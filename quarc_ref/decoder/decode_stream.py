"""Bytes of a stream to scenes: SPEC 7.

`split_chunks` proves and orders the chunks, `StreamDecoder` minds what has
been seen of the stream, `frames` makes the state of each frame.
"""

from collections.abc import Iterator

from quarc_ref.decoder.frames import decode_canonical, decode_frame
from quarc_ref.decoder.reconstruct import State
from quarc_ref.decoder.scene import Scene
from quarc_ref.format import container, wire
from quarc_ref.format.container import Chunk, split_chunks
from quarc_ref.format.errors import (
    BitstreamError,
    ChunkOrderError,
    ChunkSizeError,
    FrameOrderError,
    TailMismatchError,
)
from quarc_ref.format.records import Camera, StreamHeader, Tail


def decode(data: bytes, start: int = 0, stop: int | None = None) -> Iterator[Scene]:
    """Decode the frames of a stream.

    Args:
        data: A stream; one that is cut gives the frames that are whole first.
        start: Ordinal of the first frame wanted.
        stop: Ordinal after the last frame wanted; None for all.

    Yields:
        The scene of every frame wanted, in order.

    Raises:
        BitstreamError: What is wrong with the bytes; every frame before the
            fault has been given out.
    """
    for state in decode_states(data, start, stop):
        yield state.scene


def decode_states(data: bytes, start: int = 0, stop: int | None = None) -> Iterator[State]:
    """Do as `decode`, and yield all that a frame hands to the next."""
    decoder = StreamDecoder()
    for chunk in split_chunks(data):
        state = decoder.push(chunk)
        if state is None or state.scene.frame < start:
            continue
        if stop is not None and state.scene.frame >= stop:
            return
        yield state


class StreamDecoder:
    """Takes the chunks of a stream one by one and gives the state of every frame.

    Attributes:
        cameras: From `came`.
        metadata: From `meta`.
        tail: From TAIL; None before it.
    """

    def __init__(self) -> None:
        self.cameras: tuple[Camera, ...] = ()
        self.metadata: dict[str, str] = {}
        self.tail: Tail | None = None
        self._header: StreamHeader | None = None
        self._state: State | None = None
        self._seen = Tail(frame_count=0, canonical_count=0)

    @property
    def header(self) -> StreamHeader:
        """What HEAD says.

        Raises:
            ChunkOrderError: HEAD has not been pushed.
        """
        if self._header is None:
            message = "no HEAD yet"
            raise ChunkOrderError(message)
        return self._header

    def push(self, chunk: Chunk) -> State | None:
        """Take the next chunk.

        Args:
            chunk: As `split_chunks` gives it: its CRCs hold.

        Returns:
            The state of the frame that the chunk holds; None if it holds none.

        Raises:
            BitstreamError: What is wrong with the chunk; the decoder stays as
                it was.
        """
        try:
            return self._push(chunk)
        except BitstreamError as error:
            error.offset = chunk.offset if error.offset is None else error.offset
            raise

    def _push(self, chunk: Chunk) -> State | None:
        if chunk.kind == container.HEAD:
            self._header = wire.parse_stream_header(chunk.payload)
            return None
        if len(chunk.payload) > self.header.limits.chunk_bytes:
            message = f"{len(chunk.payload)} bytes are too many for level {self.header.level}"
            raise ChunkSizeError(message)
        if chunk.kind == container.CAME:
            self.cameras = wire.parse_cameras(chunk.payload)
        elif chunk.kind == container.META:
            self.metadata = wire.parse_metadata(chunk.payload)
        elif chunk.kind == container.TAIL:
            self.tail = self._check_tail(wire.parse_tail(chunk.payload))
        elif chunk.kind == container.CANO:
            return self._push_canonical(chunk)
        elif chunk.kind == container.FRAM:
            return self._push_frame(chunk)
        return None

    def _push_canonical(self, chunk: Chunk) -> State:
        canonical = wire.parse_canonical(chunk.payload)
        if self._state is not None and canonical.frame != self._state.scene.frame + 1:
            message = f"frame {canonical.frame} follows frame {self._state.scene.frame}"
            raise FrameOrderError(message)
        self._state = decode_canonical(self.header, canonical)
        self._seen = Tail(self._seen.frame_count + 1, self._seen.canonical_count + 1)
        return self._state

    def _push_frame(self, chunk: Chunk) -> State:
        if self._state is None:
            message = "a frame must follow a canonical frame"
            raise ChunkOrderError(message)
        self._state = decode_frame(self._state, wire.parse_frame(chunk.payload))
        self._seen = Tail(self._seen.frame_count + 1, self._seen.canonical_count)
        return self._state

    def _check_tail(self, tail: Tail) -> Tail:
        if tail != self._seen:
            message = f"TAIL says {tail}, the stream holds {self._seen}"
            raise TailMismatchError(message)
        return tail
