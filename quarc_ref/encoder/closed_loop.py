"""The closed loop: each frame is trained from the decoded state of the previous frame.

Encoder and decoder cannot drift apart, because the encoder has no state of its own: each chunk
is decoded before it is written, and the next frame starts from the decoded state.
"""

from typing import Any, BinaryIO

import numpy as np

from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.frame_coder import (
    CodedFrame,
    FrameCoder,
    FrameStart,
    MovedFrame,
    UpdateSource,
)
from quarc_ref.encoder.loop_decoder import LoopDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import (
    BitstreamError,
    ClosedLoopError,
    ResumeError,
)
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from quarc_ref.streams.stream_writer import StreamWriter


class ClosedLoop:
    """Writes the frames of a stream and decodes each one before it is written.

    A frame is written in three steps: `start_frame`, `move_frame` and a `commit` method. Each
    step takes the result of the previous step. Only the `commit` methods write to the stream;
    they and `replay` change the state of the loop.

    Args:
        sink: Binary file to which the stream is appended.
        header: Header of the stream.
        cameras: Content of the `came` chunk.
        metadata: Content of the `meta` chunk.
        existing_bytes: Number of bytes of the stream that the sink already contains. `replay`
            must be called for each frame that the sink already contains, before new frames are
            committed.

    Attributes:
        state: The decoder's state of the last frame.
        frame_bytes: Size of the last frame's chunk in bytes, including framing.
        engine: The decoder's engine.
    """

    state: FrameState
    frame_bytes: int

    def __init__(
        self,
        sink: BinaryIO,
        header: StreamHeader,
        cameras: tuple[Camera, ...],
        metadata: dict[str, str],
        existing_bytes: int = 0,
    ) -> None:
        self.engine: Engine[Any] = choose_engine()
        self._coder = FrameCoder(self.engine, header)
        self._decoder = LoopDecoder(self.engine)
        self._decoded: FrameState | None = None
        self._writer = StreamWriter(
            sink, wire.build_stream_header(header), self._decode, existing_bytes
        )
        self.write_cameras(cameras)
        self.write_metadata(metadata)

    @property
    def byte_count(self) -> int:
        """Number of bytes written to the stream so far."""
        return self._writer.offset

    def replay(self, chunk: Chunk) -> FrameState:
        """Decode a frame that the sink already contains, without writing its bytes again.

        Returns:
            The decoder's state of the frame.

        Raises:
            ResumeError: The decoder rejects the frame.
            ValueError: The chunk does not contain a frame.
        """
        try:
            self._write(chunk.kind, chunk.payload)
        except ClosedLoopError as error:
            message = f"the stream cannot be resumed: {error.__cause__}"
            raise ResumeError(message) from error
        if self._decoded is None:
            message = f"a {chunk.kind.decode()} chunk does not contain a frame"
            raise ValueError(message)
        self.state = self._decoded
        return self.state

    def write_cameras(self, cameras: tuple[Camera, ...]) -> None:
        """Write a `came` chunk, which replaces all cameras (SPEC 5.6)."""
        self._writer.write(container.CAME, wire.build_cameras(cameras))

    def write_metadata(self, metadata: dict[str, str]) -> None:
        """Write a `meta` chunk, which replaces all metadata (SPEC 5.7)."""
        self._writer.write(container.META, wire.build_metadata(metadata))

    def start_frame(self, death_count: int) -> FrameStart:
        """Start the frame after the last committed frame; see `FrameCoder.start_frame`."""
        return self._coder.start_frame(self.state, death_count)

    def move_frame(
        self, start: FrameStart, symbols: list[Int64], updates: UpdateSource = None
    ) -> MovedFrame:
        """Code the motion and updates of a frame; see `FrameCoder.move_frame`."""
        return self._coder.move_frame(start, symbols, updates)

    def count_birth_bytes(self, moved_frame: MovedFrame, births: Births) -> int:
        """Return the size of the births section in bytes; see `FrameCoder.count_birth_bytes`."""
        return self._coder.count_birth_bytes(moved_frame, births)

    def commit_canonical(
        self, gaussians: Gaussians, frame: int, origin: Int64 | None = None
    ) -> FrameState:
        """Write a canonical frame; see `FrameCoder.code_canonical`.

        Returns:
            The decoder's state of the frame.
        """
        return self._commit(self._coder.code_canonical(gaussians, frame, origin))

    def commit_frame(self, moved_frame: MovedFrame, births: Births | None) -> FrameState:
        """Write a frame with its births as a FRAM chunk.

        Raises:
            EncodeError: A new Gaussian is out of the format's range.
            ClosedLoopError: The chunk decodes to a different state.
            ValueError: The frame does not follow the last committed frame.
        """
        self._require_next(moved_frame)
        return self._commit(self._coder.complete_frame(moved_frame, births))

    def commit_as_canonical(self, moved_frame: MovedFrame, births: Births | None) -> FrameState:
        """Write a frame as a canonical frame; see `FrameCoder.code_as_canonical`.

        Raises:
            EncodeError: A Gaussian is out of the format's range.
            ClosedLoopError: The chunk decodes to a different state.
            ValueError: The frame does not follow the last committed frame.
        """
        self._require_next(moved_frame)
        return self._commit(self._coder.code_as_canonical(moved_frame, births))

    def commit_as_snapshot(
        self, moved_frame: MovedFrame, births: Births | None, dead_zone: int = 0
    ) -> FrameState:
        """Write a frame as a snapshot; see `FrameCoder.code_as_snapshot`.

        Raises:
            EncodeError: A Gaussian is out of the format's range.
            ClosedLoopError: The chunk decodes to a different state.
            ValueError: The header does not allow snapshots, or the frame does not follow the
                last committed frame.
        """
        reference = self._decoder.reference
        if reference is None:
            message = "the header does not allow snapshots"
            raise ValueError(message)
        self._require_next(moved_frame)
        canonical_indices = self._decoder.canonical_indices
        return self._commit(
            self._coder.code_as_snapshot(
                moved_frame, births, reference, canonical_indices, dead_zone
            )
        )

    def finish(self) -> None:
        """Write the index and the TAIL chunk."""
        self._writer.finish()

    def _require_next(self, moved_frame: MovedFrame) -> None:
        if moved_frame.previous is not self.state:
            message = "the frame does not follow the last committed frame"
            raise ValueError(message)

    def _commit(self, frame: CodedFrame) -> FrameState:
        """Write a frame; return the decoder's state of the frame."""
        if frame.previous is not None and frame.chunk is not None:
            self._decoder.store(frame.previous, frame.chunk, frame.state)
        self._write(frame.kind, frame.payload)
        decoded_state = self._decoded
        if decoded_state is not frame.state and (
            decoded_state is None or not _is_same_scene(decoded_state.scene, frame.state.scene)
        ):
            message = (
                f"frame {frame.state.scene.frame} decodes to a state that differs from the "
                "encoder's state"
            )
            raise ClosedLoopError(message)
        self.state = decoded_state
        return decoded_state

    def _write(self, kind: bytes, payload: bytes) -> None:
        """Write a chunk and store its size; the writer passes the chunk to the decoder first."""
        start_offset = self._writer.offset
        self._writer.write(kind, payload)
        self.frame_bytes = self._writer.offset - start_offset

    def _decode(self, chunk: Chunk) -> None:
        try:
            self._decoded = self._decoder.push(chunk)
        except BitstreamError as error:
            message = f"the decoder rejects a chunk that the encoder created: {error}"
            raise ClosedLoopError(message) from error


def _is_same_scene(first: Scene, second: Scene) -> bool:
    """Return whether all integers of two scenes are equal."""
    return (first.frame, first.phase) == (second.frame, second.phase) and all(
        np.array_equal(getattr(first, name), getattr(second, name))
        for name in ("ids", "positions", "rotations", "codes")
    )
