"""The loop closed by construction: bytes, then the decoder, then the next stage.

Every result of training becomes bytes here, and what training goes on with is
what the decoder makes of them. At the end of a frame its chunk goes through a
`LoopDecoder`, which takes no step of the frame twice, and the state that comes
out seeds the next frame.
"""

from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np

from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.loop_decoder import LoopDecoder
from quarc_ref.encoder.requantize import requantize
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.coding.gaussian_planes import sort_canonical
from quarc_ref.format.coding.snapshot_planes import write_snapshot
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import (
    BitstreamError,
    ClosedLoopError,
    EncodeError,
    EntropyError,
    ResumeError,
    StateError,
)
from quarc_ref.format.records import (
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SnapshotChunk,
    StreamHeader,
)
from quarc_ref.format.updates import Updates
from quarc_ref.streams.stream_writer import StreamWriter

EMPTY = Section(np.zeros(0, dtype=np.uint32))


class ClosedLoop:
    """Writes a stream and holds the decoder's state of it.

    Args:
        sink: Is written to by appending.
        header: Of the stream.
        cameras: For `came`.
        metadata: For `meta`.
        held: Bytes of the stream that the sink has already: its frames are to
            be replayed before any other is committed.

    Attributes:
        state: Of the last frame, as the decoder has it.
        frame_bytes: Of the last frame's chunk, framing included.
        engine: What makes and codes the states.
    """

    state: FrameState
    frame_bytes: int
    _begun: FrameState
    _moved: FrameState

    def __init__(
        self,
        sink: BinaryIO,
        header: StreamHeader,
        cameras: tuple[Camera, ...],
        metadata: dict[str, str],
        held: int = 0,
    ) -> None:
        self._header = header
        self.engine: Engine[Any] = choose_engine()
        self._decoder = LoopDecoder(self.engine)
        self._decoded: FrameState | None = None
        self._writer = StreamWriter(sink, wire.build_stream_header(header), self._decode, held)
        self._writer.write(container.CAME, wire.build_cameras(cameras))
        self._writer.write(container.META, wire.build_metadata(metadata))

    @property
    def byte_count(self) -> int:
        """Bytes of the stream so far."""
        return self._writer.offset

    def replay(self, chunk: Chunk) -> FrameState:
        """Take a frame that the sink has already; return the decoder's state of it.

        Raises:
            ResumeError: The decoder rejects it.
        """
        begun = self._writer.offset
        try:
            self._writer.write(chunk.kind, chunk.payload)
        except ClosedLoopError as error:
            message = f"the stream cannot be gone on with: {error.__cause__}"
            raise ResumeError(message) from error
        self.frame_bytes = self._writer.offset - begun
        if self._decoded is None:
            message = f"{chunk.kind.decode()} holds no frame"
            raise ValueError(message)
        self.state = self._decoded
        return self.state

    def commit_canonical(self, gaussians: Gaussians, frame: int) -> FrameState:
        """Write a canonical frame; return the decoder's state of it."""
        origin, axis_bits, ordered = sort_canonical(gaussians)
        expected = self.engine.begin_canonical(self._header, frame, ordered)
        chunk = CanonicalChunk(
            frame,
            ordered.count,
            origin,
            axis_bits,
            self.engine.write_canonical(ordered, origin),
            self.engine.state_crc(expected),
        )
        return self._push(container.CANO, wire.build_canonical(chunk), expected)

    def begin_frame(self, death_count: int) -> FrameState:
        """Return the last frame's state with the dead gone and every Gaussian bound."""
        self._begun = self.engine.begin_frame(self.state, death_count)
        self._death_count = death_count
        return self._begun

    def commit_motion(self, symbols: list[Int64], updates: Updates | None = None) -> FrameState:
        """Code the motion of a frame and its updates; return the decoder's state after them.

        The contexts of the last frame are used where they save bytes.

        Args:
            symbols: `[c, a]` of each level, level 1 first.
            updates: Of single Gaussians; None, and always so in a stream without updates,
                for none.

        Raises:
            EncodeError: A symbol, a residual or a Gaussian is beyond what the format carries.
        """
        begun = self._begun
        sections = {
            previous: self.engine.write_motion(begun, symbols, previous=previous)
            for previous in (True, False)
        }
        previous = sections[True].byte_count() < sections[False].byte_count()
        chunk = FrameChunk(
            begun.scene.phase, previous, self._death_count, 0, sections[previous], EMPTY, 0
        )
        self._chunk = wire.parse_frame(wire.build_frame(chunk))
        try:
            self._moved = self.engine.decode_motion(begun, self._chunk.motion, previous=previous)
        except StateError as error:
            raise EncodeError(str(error)) from error
        if self._header.updates:
            self._commit_updates(updates)
        return self._moved

    def _commit_updates(self, updates: Updates | None) -> None:
        """Code the updates of a frame, after its motion."""
        moved, section = self._moved, EMPTY
        if updates is not None:
            section = self.engine.write_updates(moved, updates)
        try:
            self._moved = self.engine.decode_updates(moved, section)
        except (StateError, EntropyError) as error:
            raise EncodeError(str(error)) from error
        self._chunk = replace(self._chunk, updates=section)

    def count_birth_bytes(self, births: Births) -> int:
        """Return how many bytes births take after what `commit_motion` has coded."""
        return self.engine.write_births(self._moved, births).byte_count()

    def commit_births(self, births: Births | None) -> FrameState:
        """Code the newborn of a frame and write it; return the state that seeds the next.

        Raises:
            EncodeError: A newborn is beyond what the format carries.
            ClosedLoopError: The decoder makes another state of the frame's
                bytes than the commits did.
        """
        grown, section = self._bear(births)
        chunk = replace(
            self._chunk,
            birth_count=grown.scene.count - self._moved.scene.count,
            births=section,
            state_crc=self.engine.state_crc(grown),
        )
        self._decoder.expect(self.state, chunk, grown)
        return self._push(container.FRAM, wire.build_frame(chunk), grown)

    def commit_frame_as_canonical(self, births: Births | None) -> FrameState:
        """Write a frame as a canonical one, in place of `commit_births`.

        The frame is fitted as any other; its scene is then put on the grid of
        canonical frames (SPEC 7.2). The ids start anew, so that nothing that
        is kept by id or index outlives this.

        Returns:
            The state that seeds the next frame, as the decoder has it.

        Raises:
            EncodeError: A Gaussian is beyond what the format carries.
            ClosedLoopError: The decoder makes another state of the bytes.
        """
        scene = self._bear(births)[0].scene
        try:
            return self.commit_canonical(requantize(scene), scene.frame)
        except StateError as error:
            raise EncodeError(str(error)) from error

    def commit_frame_as_snapshot(self, births: Births | None) -> FrameState:
        """Write a frame as a canonical one that is coded against the last CANO (SPEC 5.10).

        As `commit_frame_as_canonical`; the bytes are those of what has changed since.

        Raises:
            EncodeError: A Gaussian is beyond what the format carries.
            ClosedLoopError: The decoder makes another state of the bytes.
        """
        scene = self._bear(births)[0].scene
        known, kept = self._decoder.reference, self._decoder.roots
        if known is None:
            message = "the stream has no snapshots"
            raise ValueError(message)
        roots = np.full(scene.count, -1, dtype=np.int64)
        since = scene.ids < kept.size  # the others were born after the last canonical frame
        roots[since] = kept[scene.ids[since]]
        try:
            coded = write_snapshot(known.gaussians, requantize(scene), roots)
            expected = self.engine.begin_canonical(self._header, scene.frame, coded.gaussians)
        except StateError as error:
            raise EncodeError(str(error)) from error
        chunk = SnapshotChunk(
            scene.frame,
            known.frame,
            coded.newborn_count,
            coded.origin,
            coded.axis_bits,
            coded.survivors,
            coded.sections,
            self.engine.state_crc(expected),
        )
        return self._push(container.SNAP, wire.build_snapshot(chunk), expected)

    def finish(self) -> None:
        """Write the index and the end of the stream."""
        self._writer.finish()

    def _bear(self, births: Births | None) -> tuple[FrameState, Section]:
        """Return the state with the newborn of a frame, as the decoder has it, and their section.

        Raises:
            EncodeError: A newborn is beyond what the format carries.
        """
        section, count = EMPTY, 0
        if births is not None:
            section = self.engine.write_births(self._moved, births)
            count = births.newborn.count
        try:
            grown = self.engine.decode_births(self._moved, section, count)
        except StateError as error:
            raise EncodeError(str(error)) from error
        return grown, section

    def _push(self, kind: bytes, payload: bytes, expected: FrameState) -> FrameState:
        """Write a frame's chunk and take the decoder's state of it."""
        begun = self._writer.offset
        self._writer.write(kind, payload)
        self.frame_bytes = self._writer.offset - begun
        decoded = self._decoded
        if decoded is not expected and (
            decoded is None or not _is_same_scene(decoded.scene, expected.scene)
        ):
            message = f"frame {expected.scene.frame} decodes to another state than was committed"
            raise ClosedLoopError(message)
        self.state = decoded
        return decoded

    def _decode(self, chunk: Chunk) -> None:
        """Show the decoder a chunk before it is written."""
        try:
            self._decoded = self._decoder.push(chunk)
        except BitstreamError as error:
            message = f"the decoder rejects what would be written: {error}"
            raise ClosedLoopError(message) from error


def _is_same_scene(first: Scene, second: Scene) -> bool:
    """Tell whether two scenes are the same, integer by integer."""
    return (first.frame, first.phase) == (second.frame, second.phase) and all(
        np.array_equal(getattr(first, plane), getattr(second, plane))
        for plane in ("ids", "positions", "rotations", "codes")
    )
