"""Codes frames one after another, each with the CRC of its decoded state.

A rejected frame leaves the state unchanged and has a CRC of 0. The reference engine computes the
states.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar
from unittest.mock import patch

import numpy as np

from hostile.structured.draws import Draws
from hostile.structured.hostility import Hostility, Stage
from hostile.structured.pieces import Piece
from quarc_ref.decoder import frames
from quarc_ref.decoder.digest import state_crc
from quarc_ref.decoder.frames import (
    decode_canonical,
    decode_frame,
    decode_motion,
    decode_snapshot,
    decode_updates,
    read_checked_canonical,
)
from quarc_ref.decoder.reconstruct import begin_frame, motion_contexts
from quarc_ref.decoder.state import Reference, State
from quarc_ref.decoder.updates import update_context
from quarc_ref.format import container, wire
from quarc_ref.format.coding import gaussian_planes, motion_planes, snapshot_planes, update_planes
from quarc_ref.format.coding.gaussian_planes import sort_canonical, write_births, write_canonical
from quarc_ref.format.coding.motion_planes import write_motion
from quarc_ref.format.coding.snapshot_planes import write_snapshot
from quarc_ref.format.coding.update_planes import write_updates
from quarc_ref.format.constants import CODE_LIMIT, COUNTER_LIMIT
from quarc_ref.format.errors import BitstreamError, LimitError
from quarc_ref.format.records import (
    CanonicalChunk,
    FrameChunk,
    Section,
    SnapshotChunk,
    StreamHeader,
)

Record = CanonicalChunk | SnapshotChunk | FrameChunk
_Value = TypeVar("_Value")
_TRIALS = 4
_FIRST_FRAMES = (0, 0, 0, 0, 0, 0, 5, COUNTER_LIMIT - 3)
_ANY_STEP = (1 << 63) - 1  # differences of parents, beyond the limit of encoders
EMPTY = Section(np.zeros(0, dtype=np.uint32))
_AT_BEGINNINGS = (Stage.SCENE, Stage.CANONICAL, Stage.SNAPSHOT)
_KINDS: dict[type, tuple[bytes, Callable[[Any], bytes]]] = {
    CanonicalChunk: (container.CANO, wire.build_canonical),
    SnapshotChunk: (container.SNAP, wire.build_snapshot),
    FrameChunk: (container.FRAM, wire.build_frame),
}


class Builder:
    """Generates the chunks of a stream.

    Args:
        draws: Source of random values.
        header: Of the stream.

    Attributes:
        header: As given.
        pieces: The chunks so far.
        records: Records of the frames so far.
        state: State after the last valid frame.
        reference: The CANO that snapshots are coded against, if there is one.
    """

    def __init__(self, draws: Draws, header: StreamHeader) -> None:
        self.header = header
        self.pieces = [Piece(container.HEAD, wire.build_stream_header(header))]
        self.records: list[Record] = []
        self.state: State | None = None
        self.reference: Reference | None = None
        self._draws = draws
        self._hostility: Hostility | None = None

    def add_valid_frame(self) -> None:
        """Draw and code a valid frame; nothing if all drawn frames exceed a limit."""
        self._hostility = None
        is_last = self.state is not None and self.state.scene.frame == COUNTER_LIMIT
        for _ in range(0 if is_last else _TRIALS):
            record = self._draw(begins=self._draws.rng.random() < 0.15)
            state, crc = self._try_record(record)
            if state is not None:
                self._append(record, state, crc)
                return

    def add_hostile_frame(self, hostility: Hostility) -> None:
        """Draw a frame and code it with its fault."""
        self._hostility = hostility
        with self._with_stated_codes():
            record = self._draw(begins=hostility.stage in _AT_BEGINNINGS)
        self._append(record, *self._try_record(record))

    def _append(self, record: Record, state: State | None, crc: int) -> None:
        proved = replace(record, state_crc=crc)
        self.state = state or self.state
        self.records.append(proved)
        if state is not None and isinstance(record, CanonicalChunk):
            self.reference = Reference(record.frame, read_checked_canonical(self.header, record))
        kind, build = _KINDS[type(proved)]
        self.pieces.append(Piece(kind, self._change(Stage.PAYLOAD, build(proved))))

    def end(self, *, index: bool) -> None:
        """Append the end of a stream."""
        if index:
            self.pieces.append(Piece(container.INDX, None))
        self.pieces.append(Piece(container.TAIL, None))

    def _draw(self, *, begins: bool) -> Record:
        if not begins and self.state is not None:
            return self._draw_moved(self.state)
        if self._is_at_stage(Stage.SNAPSHOT) or self._draws.rng.random() < 0.5:
            with suppress(BitstreamError):  # a frame with a larger range than a snapshot can code
                return self._draw_snapshot() or self._draw_canonical()
        return self._draw_canonical()

    def _draw_snapshot(self) -> SnapshotChunk | None:
        """Return a snapshot if the stream can have one here."""
        known, state = self.reference, self.state
        if known is None or state is None or not self.header.snapshots:
            return None
        coded = write_snapshot(known.gaussians, *self._draws.changed(self.header, known.gaussians))
        chunk = SnapshotChunk(
            (state.scene.frame + 1) & COUNTER_LIMIT,
            known.frame,
            coded.newborn_count,
            coded.origin,
            coded.axis_bits,
            coded.survivors,
            coded.sections,
            0,
        )
        return self._change(Stage.SNAPSHOT, chunk)

    def _draw_canonical(self) -> CanonicalChunk:
        drawn = self._change(Stage.SCENE, self._draws.gaussians(self.header), self.header)
        origin, axis_bits, ordered = sort_canonical(drawn)
        sections = write_canonical(ordered, origin)
        first = self._draws.rng.choice(_FIRST_FRAMES)
        frame = first if self.state is None else (self.state.scene.frame + 1) & COUNTER_LIMIT
        chunk = CanonicalChunk(frame, drawn.count, origin, axis_bits, sections, 0)
        return self._change(Stage.CANONICAL, chunk)

    def _draw_moved(self, state: State) -> FrameChunk:
        rng = self._draws.rng
        deaths = rng.choice((0, 0, 1, state.scene.count // 2, state.scene.count - 1))
        started = begin_frame(state, min(deaths, state.scene.count - 1))
        symbols = self._change(Stage.MOTION, self._draws.symbols(started), started)
        previous = rng.random() < 0.5
        contexts = motion_contexts(started, previous=previous)
        motion = write_motion(contexts, symbols, started.motion_counts)
        deaths = state.scene.count - started.scene.count
        updates = EMPTY if self.header.updates else None
        chunk = FrameChunk(started.scene.phase, previous, deaths, 0, motion, EMPTY, 0, updates)
        if (
            rng.random() < 0.5
            or self._is_at_stage(Stage.BIRTHS)
            or self._is_at_stage(Stage.UPDATES)
        ):
            chunk = self._add_changes(started, chunk)
        return self._change(Stage.FRAME, chunk)

    def _add_changes(self, started: State, chunk: FrameChunk) -> FrameChunk:
        """Add updates and births to the chunk of a frame, if its motion is valid."""
        with suppress(BitstreamError):
            moved = decode_motion(started, chunk.motion, previous=chunk.previous_contexts)
            if self.header.updates:
                section = self._write_updates(moved)
                chunk = replace(chunk, updates=section)
                moved = decode_updates(moved, section)
            births = self._change(Stage.BIRTHS, self._draws.births(moved), moved)
            with patch.object(gaussian_planes, "_DIFFERENCE_LIMIT", _ANY_STEP):
                section = write_births(births, moved.birth_counts)
            return replace(chunk, birth_count=births.parents.size, births=section)
        return chunk

    def _write_updates(self, moved: State) -> Section:
        updates = self._change(Stage.UPDATES, self._draws.updates(moved), moved)
        with patch.object(update_planes, "ROTATION_UNITY_LIMIT", CODE_LIMIT):
            return write_updates(update_context(moved), updates, moved.update_counts)

    def _try_record(self, record: Record) -> tuple[State | None, int]:
        """Return the state after a record, and its CRC; None and 0 if the record is rejected."""
        with suppress(BitstreamError, LimitError), patch.object(frames, "check_state"):
            if isinstance(record, CanonicalChunk):
                state, _ = decode_canonical(self.header, record)
            elif isinstance(record, SnapshotChunk) and self.reference is not None:
                state, _ = decode_snapshot(self.header, record, self.reference.gaussians)
            elif isinstance(record, FrameChunk) and self.state is not None:
                # A frame of another stream can have updates where this stream allows none.
                payload = wire.build_frame(record)
                read = wire.parse_frame(payload, updates=self.header.updates)
                state = decode_frame(self.state, read)
            else:
                return None, 0
            return state, state_crc(state.scene)
        return None, 0

    def _change(self, stage: Stage, value: _Value, *known: Any) -> _Value:  # noqa: ANN401
        """Return a value as changed by the hostility of its stage, otherwise unchanged."""
        if self._hostility is None or not self._is_at_stage(stage):
            return value
        changed: _Value = self._hostility.change(self._draws, value, *known)
        return changed

    def _is_at_stage(self, stage: Stage) -> bool:
        return self._hostility is not None and self._hostility.stage is stage

    @contextmanager
    def _with_stated_codes(self) -> Iterator[None]:
        """Code a frame with a hostile writer of planes, if that is the hostility."""
        if not self._is_at_stage(Stage.WRITER):
            yield
            return
        open_writer = partial(self._change, Stage.WRITER)
        with (
            patch.object(gaussian_planes, "PlaneWriter", open_writer),
            patch.object(motion_planes, "PlaneWriter", open_writer),
            patch.object(update_planes, "PlaneWriter", open_writer),
            patch.object(snapshot_planes, "PlaneWriter", open_writer),
        ):
            yield
