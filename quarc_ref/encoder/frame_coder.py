"""Codes a frame in three steps: start, motion, births.

FrameState ──start_frame──> FrameStart ──move_frame──> MovedFrame ──complete_frame──> CodedFrame

Each section is decoded with the decoder's engine right after it is encoded, so the encoder's
state equals that of every decoder. `closed_loop.ClosedLoop` writes the `CodedFrame`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.state import SnapshotReference
from quarc_ref.encoder.dead_zone import undo_small_moves
from quarc_ref.encoder.requantize import find_representable, requantize, select_gaussians
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import sort_canonical
from quarc_ref.format.coding.snapshot_planes import write_snapshot
from quarc_ref.format.errors import EncodeError, EntropyError, StateError
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

UpdateSource = Updates | Callable[[FrameState], Updates | None] | None
EMPTY_SECTION = Section(np.zeros(0, dtype=np.uint32))


@dataclass(frozen=True, slots=True, eq=False)
class FrameStart:
    """A frame after its deaths and before its motion; its Gaussians have anchors (SPEC 7.4).

    Attributes:
        previous: State of the previous frame.
        state: State of this frame.
        death_count: Number of deleted Gaussians.
    """

    previous: FrameState
    state: FrameState
    death_count: int


@dataclass(frozen=True, slots=True, eq=False)
class MovedFrame:
    """A frame after its motion and updates (SPEC 7.5, 7.8), and before its births.

    Attributes:
        previous: State of the previous frame.
        state: State of this frame.
        chunk: Chunk of the frame, still without its births and state CRC.
    """

    previous: FrameState
    state: FrameState
    chunk: FrameChunk


@dataclass(frozen=True, slots=True, eq=False)
class CodedFrame:
    """A frame ready to be written.

    Attributes:
        kind: Chunk type: CANO, SNAP or FRAM.
        payload: Payload of the chunk.
        state: State to which the chunk must decode.
        previous: State of the previous frame; None for canonical frames.
        chunk: Content of a FRAM chunk, whose sections have been decoded; None for CANO and SNAP.
    """

    kind: bytes
    payload: bytes
    state: FrameState
    previous: FrameState | None = None
    chunk: FrameChunk | None = None


class FrameCoder:
    """Codes the sections of frames, and decodes each section after coding it.

    Args:
        engine: The decoder's engine.
        header: Header of the stream.
    """

    def __init__(self, engine: Engine[Any], header: StreamHeader) -> None:
        self._engine = engine
        self._header = header

    def code_canonical(
        self, gaussians: Gaussians, frame: int, origin: Int64 | None = None
    ) -> CodedFrame:
        """Code a canonical frame (SPEC 5.4).

        Args:
            gaussians: Gaussians on the grid of canonical frames, in any order.
            frame: Index of the frame in the stream.
            origin: `[3]` lower corner of the frame's box, on which the order of the Gaussians
                depends; None for the smallest box.

        Raises:
            StateError: A Gaussian is out of the format's range.
        """
        corner, axis_bits, sorted_gaussians = sort_canonical(gaussians, origin)
        state = self._engine.begin_canonical(self._header, frame, sorted_gaussians)
        chunk = CanonicalChunk(
            frame,
            sorted_gaussians.count,
            corner,
            axis_bits,
            self._engine.write_canonical(sorted_gaussians, corner),
            self._engine.state_crc(state),
        )
        return CodedFrame(container.CANO, wire.build_canonical(chunk), state)

    def start_frame(self, previous: FrameState, death_count: int) -> FrameStart:
        """Start a frame: delete faint Gaussians, and bind the others to anchors (SPEC 7.4)."""
        return FrameStart(previous, self._engine.begin_frame(previous, death_count), death_count)

    def move_frame(
        self, start: FrameStart, symbols: list[Int64], updates: UpdateSource = None
    ) -> MovedFrame:
        """Code and apply the motion of a frame, then its updates.

        The contexts of the previous frame are used if they save bytes (SPEC 8.7).

        Args:
            start: The frame before its motion.
            symbols: `[c, a]` motion symbols of each level, level 1 first.
            updates: Updates of individual Gaussians, or a function that returns them for the
                state after the motion; None for no updates.

        Raises:
            EncodeError: A symbol, a residual or a Gaussian is out of the format's range.
        """
        sections = {
            use_previous: self._engine.write_motion(start.state, symbols, use_previous=use_previous)
            for use_previous in (True, False)
        }
        use_previous = sections[True].byte_count() < sections[False].byte_count()
        chunk = FrameChunk(
            start.state.scene.phase,
            use_previous,
            start.death_count,
            0,
            sections[use_previous],
            EMPTY_SECTION,
            0,
        )
        chunk = wire.parse_frame(wire.build_frame(chunk))
        try:
            state = self._engine.decode_motion(start.state, chunk.motion, use_previous=use_previous)
            if self._header.updates:
                frame_updates = updates(state) if callable(updates) else updates
                section = (
                    EMPTY_SECTION
                    if frame_updates is None
                    else self._engine.write_updates(state, frame_updates)
                )
                state = self._engine.decode_updates(state, section)
                chunk = replace(chunk, updates=section)
        except (StateError, EntropyError) as error:
            raise EncodeError(str(error)) from error
        return MovedFrame(start.previous, state, chunk)

    def count_birth_bytes(self, moved_frame: MovedFrame, births: Births) -> int:
        """Return the size in bytes that a births section with these births would have."""
        return self._engine.write_births(moved_frame.state, births).byte_count()

    def complete_frame(self, moved_frame: MovedFrame, births: Births | None) -> CodedFrame:
        """Code the births of a frame and complete its chunk (SPEC 7.6).

        Raises:
            EncodeError: A new Gaussian is out of the format's range.
        """
        state, section = self._append_births(moved_frame, births)
        chunk = replace(
            moved_frame.chunk,
            birth_count=state.scene.count - moved_frame.state.scene.count,
            births=section,
            state_crc=self._engine.state_crc(state),
        )
        return CodedFrame(
            container.FRAM, wire.build_frame(chunk), state, moved_frame.previous, chunk
        )

    def code_as_canonical(self, moved_frame: MovedFrame, births: Births | None) -> CodedFrame:
        """Code a moved frame and its births as a canonical frame.

        The scene is requantized to the grid of canonical frames (SPEC 7.2), and Gaussians that are
        too far away for it are dropped. The Gaussians get new ids that start at 0, so earlier ids
        and indices become invalid.

        Raises:
            EncodeError: A Gaussian is out of the format's range.
        """
        scene = self._append_births(moved_frame, births)[0].scene
        gaussians = requantize(scene)
        is_kept = find_representable(gaussians.positions)
        try:
            return self.code_canonical(select_gaussians(gaussians, is_kept), scene.frame)
        except StateError as error:
            raise EncodeError(str(error)) from error

    def code_as_snapshot(
        self,
        moved_frame: MovedFrame,
        births: Births | None,
        reference: SnapshotReference,
        canonical_indices: Int64,
        dead_zone: int = 0,
    ) -> CodedFrame:
        """Code a moved frame and its births as a snapshot (SPEC 5.10).

        Gaussians that are too far away for a canonical frame are dropped.

        Args:
            moved_frame: The frame after its motion.
            births: Births of the frame; None if the frame has no births.
            reference: The last canonical frame (CANO).
            canonical_indices: `[n]` index in the CANO chunk of each Gaussian of the last keyframe,
                ordered by id; -1 for Gaussians that the CANO chunk does not contain.
            dead_zone: Largest move since the CANO that the snapshot undoes, in steps; see
                `undo_small_moves`.

        Raises:
            EncodeError: A Gaussian is out of the format's range.
        """
        scene = self._append_births(moved_frame, births)[0].scene
        scene_canonical_indices = np.full(scene.count, -1, dtype=np.int64)
        # Gaussians with higher ids were added after the keyframe.
        is_from_keyframe = scene.ids < canonical_indices.size
        scene_canonical_indices[is_from_keyframe] = canonical_indices[scene.ids[is_from_keyframe]]
        gaussians = undo_small_moves(
            requantize(scene), reference.gaussians, scene_canonical_indices, self._header, dead_zone
        )
        is_kept = find_representable(gaussians.positions)
        try:
            coded_snapshot = write_snapshot(
                reference.gaussians,
                select_gaussians(gaussians, is_kept),
                scene_canonical_indices[is_kept],
            )
            state = self._engine.begin_canonical(
                self._header, scene.frame, coded_snapshot.gaussians
            )
        except StateError as error:
            raise EncodeError(str(error)) from error
        chunk = SnapshotChunk(
            scene.frame,
            reference.frame,
            coded_snapshot.newborn_count,
            coded_snapshot.origin,
            coded_snapshot.axis_bits,
            coded_snapshot.survivors,
            coded_snapshot.sections,
            self._engine.state_crc(state),
        )
        return CodedFrame(container.SNAP, wire.build_snapshot(chunk), state)

    def _append_births(
        self, moved_frame: MovedFrame, births: Births | None
    ) -> tuple[FrameState, Section]:
        """Return the state after the births of a frame, and the births section.

        Raises:
            EncodeError: A new Gaussian is out of the format's range.
        """
        section, birth_count = EMPTY_SECTION, 0
        if births is not None:
            section = self._engine.write_births(moved_frame.state, births)
            birth_count = births.newborn.count
        try:
            return self._engine.decode_births(moved_frame.state, section, birth_count), section
        except StateError as error:
            raise EncodeError(str(error)) from error
