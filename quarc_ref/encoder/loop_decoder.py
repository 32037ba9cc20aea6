"""The decoder of a closed loop, which decodes each section of a frame only once."""

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
    """A `StreamDecoder` that reuses what the commits of a frame have already decoded.

    A frame's state depends only on the previous state and on the bytes of its chunk. The
    commits decode the sections of these bytes one by one, so their final state equals
    that of decoding the whole chunk. A chunk that differs in any byte, or follows a
    different state, is decoded completely.
    """

    _decoded: _Decoded | None = None

    def store(self, before: FrameState, chunk: FrameChunk, after: FrameState) -> None:
        """Store the result of the commits.

        Args:
            before: State of the previous frame.
            chunk: Chunk of the frame: the decoded sections, and the CRC of `after`.
            after: State from decoding them one by one.
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
