"""The decoder of a closed loop: it decodes each section of a frame once."""

from typing import NamedTuple

from quarc_ref.decoder.engine import FrameState
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import wire
from quarc_ref.format.records import FrameChunk


class _Decoded(NamedTuple):
    """A frame whose sections have been decoded one by one."""

    before: FrameState
    payload: bytes
    after: FrameState


class LoopDecoder(StreamDecoder):
    """A `StreamDecoder` that knows what the commits of a frame have decoded already.

    A frame's state depends on the state before it and on the bytes of its chunk, and on
    nothing else. The commits decode section after section of these very bytes, so the state
    that they end with is the one that decoding the whole chunk would give. A chunk that
    differs in a single byte, or follows another state, is decoded from its beginning.
    """

    _decoded: _Decoded | None = None

    def expect(self, before: FrameState, chunk: FrameChunk, after: FrameState) -> None:
        """Store what the commits have decoded.

        Args:
            before: State of the frame before.
            chunk: Chunk of the frame: its sections as they were decoded, and the CRC of `after`.
            after: What decoding them one by one has given.
        """
        self._decoded = _Decoded(before, wire.build_frame(chunk), after)

    def decode_frame(self, state: FrameState, frame: FrameChunk) -> FrameState:
        """See `StreamDecoder.decode_frame`."""
        decoded, self._decoded = self._decoded, None
        if (
            decoded is not None
            and decoded.before is state
            and decoded.payload == wire.build_frame(frame)
        ):
            return decoded.after
        return super().decode_frame(state, frame)
