"""Streams A and B of Annex G, from hand-made records without random numbers."""

from dataclasses import dataclass, field

import numpy as np

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.digest import compute_state_crc, state_crc
from quarc_ref.decoder.frames import decode_births, decode_motion, decode_updates
from quarc_ref.decoder.reconstruct import begin_frame, motion_contexts
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import update_context
from quarc_ref.format import wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import sort_canonical, write_births, write_canonical
from quarc_ref.format.coding.motion_planes import write_motion
from quarc_ref.format.coding.snapshot_planes import write_snapshot
from quarc_ref.format.coding.update_planes import write_updates
from quarc_ref.format.constants import MAGIC
from quarc_ref.format.container import build_chunk
from quarc_ref.format.records import (
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SeekPoint,
    SnapshotChunk,
    StreamHeader,
    Tail,
)
from quarc_ref.format.updates import Updates
from tests.small_streams import CAMERA

EMPTY = Section(np.zeros(0, dtype=np.uint32))


@dataclass
class StreamWriter:
    """Appends chunks to a stream, and stores the state of each frame."""

    header: StreamHeader
    data: bytes = MAGIC
    sequence: int = 0
    states: list[State] = field(default_factory=list)
    seek_points: list[SeekPoint] = field(default_factory=list)
    reference: tuple[int, Gaussians] | None = None  # ordinal and Gaussians of the last CANO

    def chunk(self, kind: bytes, payload: bytes) -> None:
        self.data += build_chunk(kind, self.sequence, payload)
        self.sequence += 1

    def canonical(self, gaussians: Gaussians, frame: int) -> None:
        origin, axis_bits, ordered = sort_canonical(gaussians)
        state = begin_canonical(self.header, frame, ordered)
        crc = compute_state_crc(state.scene, all_fields=True)
        sections = write_canonical(ordered, origin)
        chunk = CanonicalChunk(frame, ordered.count, origin, axis_bits, sections, crc)
        self.reference = (frame, ordered)
        self._append_canonical(b"CANO", wire.build_canonical(chunk), state)

    def snapshot(self, gaussians: Gaussians, canonical_indices: list[int]) -> None:
        """Write a SNAP chunk; `canonical_indices` are in the last CANO; -1 for new Gaussians."""
        assert self.reference is not None
        canonical_frame, canonical_gaussians = self.reference
        coded = write_snapshot(
            canonical_gaussians, gaussians, np.array(canonical_indices, dtype=np.int64)
        )
        frame = self.states[-1].frame + 1
        state = begin_canonical(self.header, frame, coded.gaussians)
        chunk = SnapshotChunk(
            frame,
            canonical_frame,
            coded.newborn_count,
            coded.origin,
            coded.axis_bits,
            coded.survivors,
            coded.sections,
            compute_state_crc(state.scene, all_fields=True),
        )
        self._append_canonical(b"SNAP", wire.build_snapshot(chunk), state)

    def _append_canonical(self, kind: bytes, payload: bytes, state: State) -> None:
        """Write a chunk at which decoding can begin."""
        self.seek_points.append(SeekPoint(len(self.data), self.sequence, state.frame))
        self.chunk(kind, payload)
        self.states.append(state)

    def begin(self, deaths: int) -> State:
        return begin_frame(self.states[-1], deaths)

    def frame(
        self,
        begun_state: State,
        symbols: list[Int64],
        births: Births | None,
        *,
        use_previous: bool,
        updates: Updates | None = None,
    ) -> None:
        """Write a FRAM chunk; the number of deaths follows from `begun_state`."""
        deaths = self.states[-1].scene.count - begun_state.scene.count
        motion = write_motion(
            motion_contexts(begun_state, use_previous=use_previous),
            symbols,
            begun_state.motion_counts,
        )
        state = decode_motion(begun_state, motion, use_previous=use_previous)
        update_section = None
        if updates is not None:
            update_section = write_updates(update_context(state), updates, state.update_counts)
            state = decode_updates(state, update_section)
        birth_section, count = EMPTY, 0
        if births is not None:
            birth_section, count = write_births(births, state.birth_counts), births.newborn.count
            state = decode_births(state, birth_section, count)
        crc = state_crc(state.scene)
        chunk = FrameChunk(
            state.scene.phase,
            use_previous,
            deaths,
            count,
            motion,
            birth_section,
            crc,
            update_section,
        )
        self.chunk(b"FRAM", wire.build_frame(chunk))
        self.states.append(state)

    def tail(self, *, index: bool) -> None:
        offset = len(self.data) if index else 0
        if index:
            self.chunk(b"INDX", wire.build_index(tuple(self.seek_points)))
        tail = Tail(len(self.states), len(self.seek_points), offset)
        self.chunk(b"TAIL", wire.build_tail(tail))


def columns(*rows: list[int]) -> Int64:
    return np.array(rows, dtype=np.int64).T


def build_symbols(begun_state: State, *anchor_symbols: tuple[int, int, list[int]]) -> list[Int64]:
    """Return the symbols of all anchors: those given as (level, anchor, symbols), else 0."""
    channels = begun_state.scene.header.symbol_planes
    levels = begun_state.required_anchors.levels
    symbols = [np.zeros((channels, level.owners.size), dtype=np.int64) for level in levels]
    for level, anchor, values in anchor_symbols:
        symbols[level - 1][:, anchor] = values
    return symbols


def make_still() -> StreamWriter:
    """Stream A: one canonical frame of three Gaussians with SH rest."""
    header = StreamHeader(level_count=1, timescale=25, up_axis=3, meters_per_unit=1.0)
    writer = StreamWriter(header)
    writer.chunk(b"HEAD", wire.build_stream_header(header))
    red = [-40, -41, -39, 12, 52, -20, -25, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    green = [-38, -38, -38, 20, -19, 50, -21, 0, 0, 0, 1, 0, 0, 0, 0, 0]
    blue = [-38, -30, -38, 20, -19, -19, 48, 0, 0, 0, 0, 0, 0, 0, 0, -2]
    writer.canonical(
        Gaussians(
            columns([1000, -200, 64], [1003, -205, 64], [1003, -205, 64]),
            columns([0, 0, 0, 0], [0, 12, -7, 90], [3, 0, 0, 181]),
            columns(red, green, blue),
        ),
        frame=0,
    )
    writer.tail(index=False)
    return writer


def make_moving() -> StreamWriter:
    """Stream B: seven Gaussians, motion, births, deaths, with cameras, metadata and an index."""
    header = StreamHeader(
        level=20,
        rotation_components=4,
        sh_degree=0,
        level_count=2,
        gaussians_per_anchor=2,
        anchor_ratio=2,
        resample_interval=3,
        full_crc_interval=2,
        seed=0x0123456789ABCDEF,
    )
    writer = StreamWriter(header)
    writer.chunk(b"HEAD", wire.build_stream_header(header))
    writer.chunk(b"came", wire.build_cameras((CAMERA,)))
    writer.chunk(b"meta", wire.build_metadata({"title": "seven Gaussians"}))
    writer.canonical(_make_seven_gaussians(), frame=0)

    begun_state = writer.begin(0)
    symbols = build_symbols(
        begun_state,
        (1, 0, [1, 0, -2, 0, 0, 0, 0]),
        (1, 2, [0, 0, 5, -1, 0, 0, 6]),
        (2, 0, [3, 0, 0, 0, 0, 0, -4]),
    )
    writer.frame(begun_state, symbols, None, use_previous=False)

    begun_state = writer.begin(0)
    symbols = build_symbols(
        begun_state,
        (1, 0, [4, 0, -1, 0, 0, 0, -3]),
        (1, 2, [0, 0, 5, 0, 0, 0, 5]),
        (1, 3, [0, 0, 0, 2, 0, 0, 0]),
    )
    rotations = columns([0, 0, 0, 0], [2, -30, 0, 181])
    codes = columns([-40, -41, -40, 20, 12, -8, 3], [-36, -37, -36, 22, -12, 0, 13])
    # The second newborn is equally far from the third and the fourth anchor of level 1.
    newborn_positions = columns([6, -3, 0], [5, 0, -15])
    births = Births(
        np.array([1, 5], dtype=np.int64), Gaussians(newborn_positions, rotations, codes)
    )
    writer.frame(begun_state, symbols, births, use_previous=True)

    begun_state = writer.begin(2)
    newborn = Gaussians(columns([1, 0, 0]), rotations[:, :1], codes[:, :1] + 1)
    births = Births(np.array([begun_state.scene.count - 1], dtype=np.int64), newborn)
    symbols = build_symbols(begun_state, (2, 1, [0, 65, 0, 0, 0, 0, 0]))
    writer.frame(begun_state, symbols, births, use_previous=True)
    writer.tail(index=True)
    return writer


def _make_seven_gaussians() -> Gaussians:
    return Gaussians(
        columns(
            *([0, 0, 0], [5, 0, 0], [5, 0, 0], [60, 60, 3], [64, 60, 0], [-30, 8, 90]), [-30, 9, 90]
        ),
        columns(
            *([0, 0, 0, 0], [0, 0, 0, 9], [1, -3, 4, 5], [2, 0, 0, 0], [3, 100, 0, 0], [0] * 4),
            [0, 0, 20, 0],
        ),
        columns(
            [-40, -40, -40, 16, 0, 0, 0],
            [-40, -40, -40, -9, 10, -10, 0],
            [-41, -40, -38, 16, 40, 40, 40],
            [-36, -36, -36, 3, -12, 0, 12],
            [-36, -37, -36, -9, -12, 0, 13],
            [-44, -40, -40, 30, 0, 0, -30],
            [-44, -40, -40, 29, 0, 0, -30],
        ),
    )
