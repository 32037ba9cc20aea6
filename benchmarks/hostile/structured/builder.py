"""Codes the frames of a stream, each with the CRC of its decoded state.

If the engine rejects a frame, the state does not change, and the state CRC of the frame is 0. The
reference engine decodes the frames.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar
from unittest.mock import patch

import numpy as np

from hostile.structured.fault import Fault, Stage
from hostile.structured.generator import RecordGenerator
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
from quarc_ref.decoder.state import SnapshotReference, State
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
_MAX_ATTEMPTS = 4
_FIRST_ORDINALS = (0, 0, 0, 0, 0, 0, 5, COUNTER_LIMIT - 3)
_MAX_PARENT_DIFFERENCE = (1 << 63) - 1  # allows larger differences of parents than encoders write
EMPTY_SECTION = Section(np.zeros(0, dtype=np.uint32))
_KEYFRAME_STAGES = (Stage.SCENE, Stage.CANONICAL, Stage.SNAPSHOT)
_CHUNK_TYPES: dict[type, tuple[bytes, Callable[[Any], bytes]]] = {
    CanonicalChunk: (container.CANO, wire.build_canonical),
    SnapshotChunk: (container.SNAP, wire.build_snapshot),
    FrameChunk: (container.FRAM, wire.build_frame),
}


class StreamBuilder:
    """Generates the chunks of a stream.

    Args:
        generator: Source of random values.
        header: Header of the stream.

    Attributes:
        header: Header of the stream.
        pieces: Chunks added so far.
        records: Records of the frames added so far.
        state: State after the last valid frame; None before the first valid frame.
        reference: The last canonical frame, against which snapshots are coded; None before the
            first canonical frame.
    """

    def __init__(self, generator: RecordGenerator, header: StreamHeader) -> None:
        self.header = header
        self.pieces = [Piece(container.HEAD, wire.build_stream_header(header))]
        self.records: list[Record] = []
        self.state: State | None = None
        self.reference: SnapshotReference | None = None
        self._generator = generator
        self._fault: Fault | None = None

    def add_valid_frame(self) -> None:
        """Generate and code a valid frame; add no frame if all generated frames exceed a limit."""
        self._fault = None
        is_last = self.state is not None and self.state.scene.frame == COUNTER_LIMIT
        for _ in range(0 if is_last else _MAX_ATTEMPTS):
            record = self._generate_record(is_keyframe=self._generator.rng.random() < 0.15)
            state, crc = self._try_decoding(record)
            if state is not None:
                self._append_record(record, state, crc)
                return

    def add_hostile_frame(self, fault: Fault) -> None:
        """Generate a frame, and code it with the given fault."""
        self._fault = fault
        with self._use_fault_writer():
            record = self._generate_record(is_keyframe=fault.stage in _KEYFRAME_STAGES)
        self._append_record(record, *self._try_decoding(record))

    def _append_record(self, record: Record, state: State | None, crc: int) -> None:
        record_with_crc = replace(record, state_crc=crc)
        self.state = state or self.state
        self.records.append(record_with_crc)
        if state is not None and isinstance(record, CanonicalChunk):
            self.reference = SnapshotReference(
                record.frame, read_checked_canonical(self.header, record)
            )
        kind, build_payload = _CHUNK_TYPES[type(record_with_crc)]
        self.pieces.append(
            Piece(kind, self._apply_fault(Stage.PAYLOAD, build_payload(record_with_crc)))
        )

    def finish(self, *, index: bool) -> None:
        """Append TAIL and, if `index` is set, INDX before it."""
        if index:
            self.pieces.append(Piece(container.INDX, None))
        self.pieces.append(Piece(container.TAIL, None))

    def _generate_record(self, *, is_keyframe: bool) -> Record:
        if not is_keyframe and self.state is not None:
            return self._generate_frame(self.state)
        if self._is_at_stage(Stage.SNAPSHOT) or self._generator.rng.random() < 0.5:
            with suppress(BitstreamError):  # the frame's range may be too large for a snapshot
                return self._generate_snapshot() or self._generate_canonical()
        return self._generate_canonical()

    def _generate_snapshot(self) -> SnapshotChunk | None:
        """Generate a snapshot; return None if the stream cannot contain one at this point."""
        reference, state = self.reference, self.state
        if reference is None or state is None or not self.header.snapshots:
            return None
        snapshot = write_snapshot(
            reference.gaussians,
            *self._generator.generate_snapshot(self.header, reference.gaussians),
        )
        chunk = SnapshotChunk(
            (state.scene.frame + 1) & COUNTER_LIMIT,
            reference.frame,
            snapshot.newborn_count,
            snapshot.origin,
            snapshot.axis_bits,
            snapshot.survivors,
            snapshot.sections,
            0,
        )
        return self._apply_fault(Stage.SNAPSHOT, chunk)

    def _generate_canonical(self) -> CanonicalChunk:
        gaussians = self._apply_fault(
            Stage.SCENE, self._generator.generate_gaussians(self.header), self.header
        )
        origin, axis_bits, sorted_gaussians = sort_canonical(gaussians)
        sections = write_canonical(sorted_gaussians, origin)
        first_ordinal = self._generator.rng.choice(_FIRST_ORDINALS)
        frame = (
            first_ordinal if self.state is None else (self.state.scene.frame + 1) & COUNTER_LIMIT
        )
        chunk = CanonicalChunk(frame, gaussians.count, origin, axis_bits, sections, 0)
        return self._apply_fault(Stage.CANONICAL, chunk)

    def _generate_frame(self, state: State) -> FrameChunk:
        rng = self._generator.rng
        deaths = rng.choice((0, 0, 1, state.scene.count // 2, state.scene.count - 1))
        frame_start = begin_frame(state, min(deaths, state.scene.count - 1))
        symbols = self._apply_fault(
            Stage.MOTION, self._generator.generate_symbols(frame_start), frame_start
        )
        uses_previous_contexts = rng.random() < 0.5
        contexts = motion_contexts(frame_start, use_previous=uses_previous_contexts)
        motion = write_motion(contexts, symbols, frame_start.motion_counts)
        deaths = state.scene.count - frame_start.scene.count
        updates = EMPTY_SECTION if self.header.updates else None
        chunk = FrameChunk(
            frame_start.scene.phase,
            uses_previous_contexts,
            deaths,
            0,
            motion,
            EMPTY_SECTION,
            0,
            updates,
        )
        if (
            rng.random() < 0.5
            or self._is_at_stage(Stage.BIRTHS)
            or self._is_at_stage(Stage.UPDATES)
        ):
            chunk = self._add_updates_and_births(frame_start, chunk)
        return self._apply_fault(Stage.FRAME, chunk)

    def _add_updates_and_births(self, frame_start: State, chunk: FrameChunk) -> FrameChunk:
        """Return the frame with updates and births added to it, if its motion is valid."""
        with suppress(BitstreamError):
            moved_frame = decode_motion(
                frame_start, chunk.motion, use_previous=chunk.previous_contexts
            )
            if self.header.updates:
                section = self._write_updates(moved_frame)
                chunk = replace(chunk, updates=section)
                moved_frame = decode_updates(moved_frame, section)
            births = self._apply_fault(
                Stage.BIRTHS, self._generator.generate_births(moved_frame), moved_frame
            )
            with patch.object(gaussian_planes, "_DIFFERENCE_LIMIT", _MAX_PARENT_DIFFERENCE):
                section = write_births(births, moved_frame.birth_counts)
            return replace(chunk, birth_count=births.parents.size, births=section)
        return chunk

    def _write_updates(self, moved_frame: State) -> Section:
        updates = self._apply_fault(
            Stage.UPDATES, self._generator.generate_updates(moved_frame), moved_frame
        )
        with patch.object(update_planes, "ROTATION_UNITY_LIMIT", CODE_LIMIT):
            return write_updates(update_context(moved_frame), updates, moved_frame.update_counts)

    def _try_decoding(self, record: Record) -> tuple[State | None, int]:
        """Decode a record; return the state and its CRC, or (None, 0) if it is rejected."""
        with suppress(BitstreamError, LimitError), patch.object(frames, "check_state"):
            if isinstance(record, CanonicalChunk):
                state, _ = decode_canonical(self.header, record)
            elif isinstance(record, SnapshotChunk) and self.reference is not None:
                state, _ = decode_snapshot(self.header, record, self.reference.gaussians)
            elif isinstance(record, FrameChunk) and self.state is not None:
                # A frame of another stream can have updates even if this stream allows none.
                payload = wire.build_frame(record)
                parsed = wire.parse_frame(payload, updates=self.header.updates)
                state = decode_frame(self.state, parsed)
            else:
                return None, 0
            return state, state_crc(state.scene)
        return None, 0

    def _apply_fault(self, stage: Stage, value: _Value, *context: Any) -> _Value:  # noqa: ANN401
        """Return the value, changed by the current fault if that fault applies at this stage."""
        if self._fault is None or not self._is_at_stage(stage):
            return value
        changed_value: _Value = self._fault.change(self._generator, value, *context)
        return changed_value

    def _is_at_stage(self, stage: Stage) -> bool:
        return self._fault is not None and self._fault.stage is stage

    @contextmanager
    def _use_fault_writer(self) -> Iterator[None]:
        """Replace `PlaneWriter` with the writer of the current fault, if the fault has one."""
        if not self._is_at_stage(Stage.WRITER):
            yield
            return
        open_writer = partial(self._apply_fault, Stage.WRITER)
        with (
            patch.object(gaussian_planes, "PlaneWriter", open_writer),
            patch.object(motion_planes, "PlaneWriter", open_writer),
            patch.object(update_planes, "PlaneWriter", open_writer),
            patch.object(snapshot_planes, "PlaneWriter", open_writer),
        ):
            yield
