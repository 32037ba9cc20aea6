"""The decoder of the closed loop, which decodes each section of a frame only once."""

from typing import NamedTuple

from quarc_ref.decoder.engine import FrameState
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import wire
from quarc_ref.format.records import FrameChunk


class _DecodedFrame(NamedTuple):
    """A frame whose sections the frame coder has already decoded."""

    previous_state: FrameState
    payload: bytes
    state: FrameState


class LoopDecoder(StreamDecoder):
    """A `StreamDecoder` that reuses the state that the frame coder has already decoded.

    A frame's state depends only on the previous state and on the bytes of its chunk. The frame
    coder decodes the sections of the chunk one by one, so its final state equals the result of
    decoding the chunk. A chunk is decoded again if it differs from the stored chunk in any byte, or
    if it follows a different state.
    """

    _decoded: _DecodedFrame | None = None

    def store(self, previous_state: FrameState, chunk: FrameChunk, state: FrameState) -> None:
        """Store the state of a frame whose sections have been decoded.

        Args:
            previous_state: State of the previous frame.
            chunk: Chunk of the frame, with the CRC of `state`.
            state: State after decoding the sections of the chunk one by one.
        """
        self._decoded = _DecodedFrame(previous_state, wire.build_frame(chunk), state)

    def decode_frame(self, state: FrameState, chunk: FrameChunk) -> FrameState:
        """See `StreamDecoder.decode_frame`."""
        decoded, self._decoded = self._decoded, None
        if (
            decoded is not None
            and decoded.previous_state is state
            and decoded.payload == wire.build_frame(chunk)
        ):
            return decoded.state
        return super().decode_frame(state, chunk)
