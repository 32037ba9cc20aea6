"""Decodes the chunks of a stream, one after another, to the states of its frames: SPEC 5, 7.

`ChunkReader` checks the chunks and their order; an engine computes the state of each frame.
"""

from typing import Any

import numpy as np

from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.decoder.state import SnapshotReference
from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import (
    BitstreamError,
    ChunkOrderError,
    FrameOrderError,
    IndexMismatchError,
    TailMismatchError,
)
from quarc_ref.format.records import FrameChunk, SeekPoint, StreamHeader, Tail
from quarc_ref.format.seek_points import SeekPoints


class StreamDecoder:
    """Decodes the chunks of a stream one by one.

    Args:
        engine: The decoder engine; None to use the one that `choose_engine` returns.

    Attributes:
        cameras: Cameras from the `came` chunk.
        metadata: Metadata from the `meta` chunk.
        index: Seek points from the INDX chunk; None until it is decoded.
        tail: Content of the TAIL chunk; None until it is decoded.
        reference: The last CANO; None before the first, and in streams without snapshots.
        canonical_indices: `[N]` index in the CANO of each Gaussian of the last canonical frame or
            snapshot, -1 for new Gaussians; empty in streams without snapshots.
    """

    def __init__(self, engine: Engine[Any] | None = None) -> None:
        self._engine: Engine[FrameState] = engine or choose_engine()
        self.cameras: tuple[Camera, ...] = ()
        self.metadata: dict[str, str] = {}
        self.index: SeekPoints | None = None
        self.tail: Tail | None = None
        self._header: StreamHeader | None = None
        self._state: FrameState | None = None
        self._frame_count = 0
        self._skipped_points = SeekPoints.from_records(())
        self._points: list[SeekPoint] = []
        self._index_offset = 0
        self._seek_target: SeekPoint | None = None
        self._is_complete = True
        self.reference: SnapshotReference | None = None
        self.canonical_indices = np.zeros(0, dtype=np.int64)

    @property
    def header(self) -> StreamHeader:
        """The stream's header.

        Raises:
            ChunkOrderError: HEAD has not been pushed.
        """
        if self._header is None:
            message = "no HEAD chunk has been decoded yet"
            raise ChunkOrderError(message)
        return self._header

    def skip_to(self, points: SeekPoints, canonical: Chunk | None = None) -> None:
        """Continue decoding at a seek point.

        Args:
            points: All seek points up to the target; empty to continue at the next chunk.
            canonical: The CANO that the target refers to; None if it is not a snapshot.

        Raises:
            BitstreamError: The CANO is invalid.
        """
        if canonical is not None:
            self._decode_canonical(canonical, points.find_by_offset(canonical.offset))
        if points:
            self._skipped_points = points[:-1]
            self._frame_count = points[-1].frame - points[0].frame
            self._seek_target = points[-1]

    def mark_lost(self) -> None:
        """Treat the chunks up to the next canonical frame as lost (SPEC 11.4)."""
        self._state = None
        self._is_complete = False

    def push(self, chunk: Chunk) -> FrameState | None:
        """Decode the next chunk.

        Args:
            chunk: A chunk from a `ChunkReader`, with valid CRCs.

        Returns:
            The state of the frame in the chunk; None if it contains no frame.

        Raises:
            BitstreamError: The chunk is invalid; the state of the decoder is unchanged.
        """
        try:
            return self._push(chunk)
        except BitstreamError as error:
            error.offset = chunk.offset if error.offset is None else error.offset
            raise

    def _push(self, chunk: Chunk) -> FrameState | None:
        if chunk.kind == container.HEAD:
            self._header = wire.parse_stream_header(chunk.payload)
            return None
        container.check_length(len(chunk.payload), self.header, chunk.offset)
        if chunk.kind == container.CAME:
            self.cameras = wire.parse_cameras(chunk.payload)
        elif chunk.kind == container.META:
            self.metadata = wire.parse_metadata(chunk.payload)
        elif chunk.kind == container.INDX:
            self._read_index(chunk)
        elif chunk.kind == container.TAIL:
            self._read_tail(wire.parse_tail(chunk.payload))
        elif chunk.kind in container.CANONICAL_TYPES:
            return self._push_canonical(chunk)
        elif chunk.kind == container.FRAM:
            return self._push_frame(chunk)
        return None

    def _push_canonical(self, chunk: Chunk) -> FrameState:
        decode = self._decode_canonical if chunk.kind == container.CANO else self._decode_snapshot
        self._state = decode(chunk, self._seek_target)
        self._points.append(SeekPoint(chunk.offset, chunk.sequence, self._state.frame))
        self._seek_target = None
        self._frame_count += 1
        return self._state

    def _decode_canonical(self, chunk: Chunk, seek_target: SeekPoint | None) -> FrameState:
        canonical = wire.parse_canonical(chunk.payload)
        self._check_position(chunk, canonical.frame, seek_target)
        state, gaussians = self._engine.decode_canonical(self.header, canonical)
        if self.header.snapshots:
            self.reference = SnapshotReference(canonical.frame, gaussians)
            self.canonical_indices = np.arange(gaussians.count)
        return state

    def _decode_snapshot(self, chunk: Chunk, seek_target: SeekPoint | None) -> FrameState:
        if self.reference is None:
            message = "a snapshot must follow a CANO"
            raise ChunkOrderError(message)
        snapshot = wire.parse_snapshot(chunk.payload)
        self._check_position(chunk, snapshot.frame, seek_target)
        if snapshot.canonical != self.reference.frame:  # [7.9-2]
            message = f"frame {snapshot.frame} is coded against frame {snapshot.canonical}, "
            message += f"but the last CANO is frame {self.reference.frame}"
            raise FrameOrderError(message)
        decoded = self._engine.decode_snapshot(self.header, snapshot, self.reference.gaussians)
        state, self.canonical_indices = decoded
        return state

    def _check_position(self, chunk: Chunk, frame: int, seek_target: SeekPoint | None) -> None:
        """Reject a canonical frame whose ordinal, offset or sequence number is unexpected."""
        previous = None if self._state is None else self._state.frame
        if previous is not None and frame != previous + 1:  # [7.2-1] [7.9-1]
            message = f"frame {frame} follows frame {previous}; expected frame {previous + 1}"
            raise FrameOrderError(message)
        point = SeekPoint(chunk.offset, chunk.sequence, frame)
        if seek_target not in (None, point):  # [11.2-1] [11.2-4]
            message = f"the index lists {seek_target}, but the stream has {point}"
            raise IndexMismatchError(message)

    def _push_frame(self, chunk: Chunk) -> FrameState:
        if self._state is None:  # [5.1-3]
            message = "a frame must follow a canonical frame"
            raise ChunkOrderError(message)
        frame_chunk = wire.parse_frame(chunk.payload, updates=self.header.updates)
        self._state = self.decode_frame(self._state, frame_chunk)
        self._frame_count += 1
        return self._state

    def decode_frame(self, state: FrameState, chunk: FrameChunk) -> FrameState:
        """Return the state of the frame after `state`; see `Engine.decode_frame`."""
        return self._engine.decode_frame(state, chunk)

    def _read_index(self, chunk: Chunk) -> None:
        index = wire.parse_index(chunk.payload)
        # Required by [5.9-1], [5.9-2] and [11.4-3].
        if self._is_complete and index != self._skipped_points.with_appended(self._points):
            message = "INDX does not list the canonical frames of the stream"
            raise IndexMismatchError(message)
        self.index, self._index_offset = index, chunk.offset

    def _read_tail(self, tail: Tail) -> None:
        canonical_count = len(self._skipped_points) + len(self._points)
        expected = Tail(self._frame_count, canonical_count, self._index_offset)
        if self._is_complete and tail != expected:  # [5.8-1] [5.8-2]
            message = f"TAIL does not match the stream ({tail}; expected {expected})"
            raise TailMismatchError(message)
        self.tail = tail
