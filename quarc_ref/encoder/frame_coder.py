"""Codes a frame in steps: started, moved, then coded and ready to be written.

FrameState ──start──> FrameStart ──move──> MovedFrame ──with_births──> CodedFrame

Every step encodes the encoder's decisions and decodes them with the decoder's engine, so
its state equals that of a decoder. A `CodedFrame` is written by `closed_loop.ClosedLoop`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.state import Reference
from quarc_ref.encoder.dead_zone import undo_small_moves
from quarc_ref.encoder.requantize import requantize
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

GivenUpdates = Updates | Callable[[FrameState], Updates] | None
EMPTY = Section(np.zeros(0, dtype=np.uint32))


@dataclass(frozen=True, slots=True, eq=False)
class FrameStart:
    """A frame before its motion: deaths applied, every Gaussian bound to anchors (SPEC 7.4).

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
    """A frame after its motion and updates (SPEC 7.5, 7.8), before its births.

    Attributes:
        previous: State of the previous frame.
        state: State of this frame.
        chunk: Chunk of the frame without births and state CRC.
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
        state: State that decoding the chunk must give.
        previous: State of the previous frame; None for frames that do not depend on one.
        chunk: The chunk of a FRAM, whose sections have been decoded; None otherwise.
    """

    kind: bytes
    payload: bytes
    state: FrameState
    previous: FrameState | None = None
    chunk: FrameChunk | None = None


class FrameCoder:
    """Codes frames and decodes them, section by section.

    Args:
        engine: The decoder's engine.
        header: Header of the stream.
    """

    def __init__(self, engine: Engine[Any], header: StreamHeader) -> None:
        self._engine = engine
        self._header = header

    def canonical(self, gaussians: Gaussians, frame: int) -> CodedFrame:
        """Code a canonical frame (SPEC 5.4).

        Args:
            gaussians: Gaussians on the grid of canonical frames, in any order.
            frame: Index of the frame in the stream.

        Raises:
            StateError: A Gaussian is out of the format's range.
        """
        origin, axis_bits, ordered = sort_canonical(gaussians)
        state = self._engine.begin_canonical(self._header, frame, ordered)
        chunk = CanonicalChunk(
            frame,
            ordered.count,
            origin,
            axis_bits,
            self._engine.write_canonical(ordered, origin),
            self._engine.state_crc(state),
        )
        return CodedFrame(container.CANO, wire.build_canonical(chunk), state)

    def start(self, previous: FrameState, death_count: int) -> FrameStart:
        """Start the next frame: delete the faintest Gaussians and bind the rest (SPEC 7.4)."""
        return FrameStart(previous, self._engine.begin_frame(previous, death_count), death_count)

    def move(
        self, start: FrameStart, symbols: list[Int64], updates: GivenUpdates = None
    ) -> MovedFrame:
        """Code and apply the motion of a frame, then its updates.

        The contexts of the previous frame are used where they save bytes (SPEC 8.7).

        Args:
            start: The frame.
            symbols: `[c, a]` motion symbols of each level, level 1 first.
            updates: Updates of individual Gaussians, or a function that finds them, given the
                state after the motion; must be None if the stream has none.

        Raises:
            EncodeError: A symbol, a residual or a Gaussian is out of the format's range.
        """
        sections = {
            previous: self._engine.write_motion(start.state, symbols, previous=previous)
            for previous in (True, False)
        }
        previous = sections[True].byte_count() < sections[False].byte_count()
        chunk = FrameChunk(
            start.state.scene.phase, previous, start.death_count, 0, sections[previous], EMPTY, 0
        )
        chunk = wire.parse_frame(wire.build_frame(chunk))
        try:
            state = self._engine.decode_motion(start.state, chunk.motion, previous=previous)
            if self._header.updates:
                found = updates(state) if callable(updates) else updates
                section = EMPTY if found is None else self._engine.write_updates(state, found)
                state = self._engine.decode_updates(state, section)
                chunk = replace(chunk, updates=section)
        except (StateError, EntropyError) as error:
            raise EncodeError(str(error)) from error
        return MovedFrame(start.previous, state, chunk)

    def birth_bytes(self, moved: MovedFrame, births: Births) -> int:
        """Return the size of the births section if these births were coded in this frame."""
        return self._engine.write_births(moved.state, births).byte_count()

    def with_births(self, moved: MovedFrame, births: Births | None) -> CodedFrame:
        """Complete a frame by coding its births (SPEC 7.6).

        Raises:
            EncodeError: A new Gaussian is out of the format's range.
        """
        state, section = self._append(moved, births)
        chunk = replace(
            moved.chunk,
            birth_count=state.scene.count - moved.state.scene.count,
            births=section,
            state_crc=self._engine.state_crc(state),
        )
        return CodedFrame(container.FRAM, wire.build_frame(chunk), state, moved.previous, chunk)

    def as_canonical(self, moved: MovedFrame, births: Births | None) -> CodedFrame:
        """Code a fitted frame as a canonical frame.

        Its scene is requantized to the grid of canonical frames (SPEC 7.2). Ids start
        again at 0, so earlier ids and indices become invalid.

        Raises:
            EncodeError: A Gaussian is out of the format's range.
        """
        scene = self._append(moved, births)[0].scene
        try:
            return self.canonical(requantize(scene), scene.frame)
        except StateError as error:
            raise EncodeError(str(error)) from error

    def as_snapshot(
        self,
        moved: MovedFrame,
        births: Births | None,
        reference: Reference,
        roots: Int64,
        dead_zone: int = 0,
    ) -> CodedFrame:
        """Code a fitted frame as a snapshot, relative to a canonical frame (SPEC 5.10).

        Args:
            moved: The frame.
            births: Its births.
            reference: The last canonical frame (CANO).
            roots: `[n]` index in the CANO of each Gaussian of the last keyframe, by id;
                -1 for those that are not in it.
            dead_zone: Steps within which moves since the CANO are undone; see
                `undo_small_moves`.

        Raises:
            EncodeError: A Gaussian is out of the format's range.
        """
        scene = self._append(moved, births)[0].scene
        scene_roots = np.full(scene.count, -1, dtype=np.int64)
        is_old = scene.ids < roots.size  # the others were added after the last canonical frame
        scene_roots[is_old] = roots[scene.ids[is_old]]
        gaussians = undo_small_moves(
            requantize(scene), reference.gaussians, scene_roots, self._header, dead_zone
        )
        try:
            coded = write_snapshot(reference.gaussians, gaussians, scene_roots)
            state = self._engine.begin_canonical(self._header, scene.frame, coded.gaussians)
        except StateError as error:
            raise EncodeError(str(error)) from error
        chunk = SnapshotChunk(
            scene.frame,
            reference.frame,
            coded.newborn_count,
            coded.origin,
            coded.axis_bits,
            coded.survivors,
            coded.sections,
            self._engine.state_crc(state),
        )
        return CodedFrame(container.SNAP, wire.build_snapshot(chunk), state)

    def _append(self, moved: MovedFrame, births: Births | None) -> tuple[FrameState, Section]:
        """Return the state with the births of a frame, and their section.

        Raises:
            EncodeError: A new Gaussian is out of the format's range.
        """
        section, count = EMPTY, 0
        if births is not None:
            section = self._engine.write_births(moved.state, births)
            count = births.newborn.count
        try:
            return self._engine.decode_births(moved.state, section, count), section
        except StateError as error:
            raise EncodeError(str(error)) from error
