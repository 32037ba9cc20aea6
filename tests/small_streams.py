"""Small streams that are coded from random records, without training and torch."""

import io
from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np

from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.decoder.state import State
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import MAGIC, RESIDUAL_ROWS
from quarc_ref.format.container import build_chunk
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from quarc_ref.format.updates import UPDATE_FIELDS, Updates
from quarc_ref.streams.source import BytesSource

CAMERA = Camera(
    "cam00", 64, 48, 50.0, 50.0, 32.0, 24.0, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 2), 0.5, True
)


def make_gaussians(header: StreamHeader, count: int, seed: int = 0) -> Gaussians:
    """Gaussians in a small box, some of them at the same position."""
    rng = np.random.default_rng(seed)
    positions = rng.integers(-400, 400, (3, count))
    positions[:, count // 2 : count // 2 + 3] = positions[:, :1]
    limit = (1 << header.rotation_bits) // 2
    rotations = np.concatenate(
        [rng.integers(0, 4, (1, count)), rng.integers(-limit, limit + 1, (3, count))]
    )
    return Gaussians(positions, rotations, rng.integers(-60, 60, (header.code_planes, count)))


def make_births(state: State, count: int, seed: int = 0) -> Births:
    """Births near random parents."""
    rng = np.random.default_rng(seed)
    gaussians = make_gaussians(state.scene.header, count, seed)
    parents = np.sort(rng.integers(0, state.scene.count, count))
    return Births(parents, replace(gaussians, positions=rng.integers(-20, 20, (3, count))))


def make_symbols(state: State, seed: int = 0, share: float = 0.3) -> list[np.ndarray]:
    """Symbols of the anchors of a state, most of which are 0."""
    rng = np.random.default_rng(seed)
    levels = []
    for level in state.required_anchors.levels:
        shape = (state.scene.header.symbol_planes, level.owners.size)
        is_moving = rng.random(shape[1]) < share
        levels.append(rng.integers(-3, 4, shape) * is_moving)
    return levels


def make_updates(
    state: State, seed: int = 0, share: float = 0.3, death_share: float = 0.1
) -> Updates:
    """Updates of some fields of random Gaussians; at least one Gaussian remains."""
    rng = np.random.default_rng(seed)
    indices = np.flatnonzero(rng.random(state.scene.count) < share)
    is_deleted = rng.random(indices.size) < death_share
    is_deleted[:1] = False
    residuals = rng.integers(-4, 5, (RESIDUAL_ROWS, indices.size)) * ~is_deleted
    for rows in UPDATE_FIELDS.values():
        residuals[rows] *= rng.random(indices.size) < 0.5
    return Updates(indices, is_deleted, residuals)


@cache
def make_stream(
    header: StreamHeader | None = None,
    gaussian_count: int = 40,
    frame_count: int = 4,
    canonical_every: int = 1 << 32,
    births: int = 3,
    snapshot_every: int = 1 << 32,
) -> tuple[bytes, tuple[State, ...]]:
    """A stream with motion, births, deaths and the features of its header, and its states.

    Many modules need the same few streams, so these are made once.
    """
    header = header or StreamHeader(seed=7, resample_interval=2, gaussians_per_anchor=4)
    sink = io.BytesIO()
    with use_engine(REFERENCE):  # any engine is compared with the reference
        loop = ClosedLoop(sink, header, (CAMERA,), {"capture": "made by hand"})
    states = [loop.commit_canonical(make_gaussians(header, gaussian_count), frame=0)]
    for frame in range(1, frame_count):
        start = loop.start_frame(max(0, loop.state.scene.count - gaussian_count))
        updates = make_updates(start.state, frame) if header.updates else None
        moved = loop.move_frame(start, make_symbols(start.state, frame), updates)
        frame_births = make_births(moved.state, births, frame) if births and frame % 2 else None
        commit = loop.commit_frame
        if frame % canonical_every == 0:
            commit = loop.commit_as_canonical
        elif frame % snapshot_every == 0:
            commit = loop.commit_as_snapshot
        states.append(commit(moved, frame_births))
    loop.finish()
    return sink.getvalue(), tuple(states)


def rebuild_stream(chunks: Iterable[tuple[bytes, bytes]]) -> bytes:
    """A stream of chunks, given as (type, payload), with sequence numbers and CRCs."""
    numbered = [build_chunk(kind, number, data) for number, (kind, data) in enumerate(chunks)]
    return MAGIC + b"".join(numbered)


class CountedSource(BytesSource):
    """A stream in memory that records each read as (offset, length)."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self.reads: list[tuple[int, int]] = []

    def read(self, offset: int, length: int) -> bytes:
        data = super().read(offset, length)
        self.reads.append((offset, len(data)))
        return data

    def byte_count(self) -> int:
        return sum(length for _, length in self.reads)


class GrowingSource(CountedSource):
    """A stream of which another byte arrives whenever a reader waits."""

    def __init__(self, data: bytes, first_bytes: int) -> None:
        super().__init__(data[:first_bytes])
        self._all_bytes = data

    def wait(self, _seconds: float = 0) -> None:
        """Let a byte arrive; instead of `time.sleep`."""
        self._data = self._all_bytes[: len(self._data) + 1]
