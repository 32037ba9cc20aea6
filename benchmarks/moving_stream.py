"""Generates a stream of simulated Gaussians in motion, for timing decoders; needs no torch.

The scene is a room with furniture, dense clusters and sparse outskirts, coded with the steps of the
preset `main`. A few objects move, each with its own steady motion. The symbols of each anchor level
code a third of the motion, rounded to steps. In every frame, as many Gaussians die as are born.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.files import atomic_file
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import sort_canonical
from quarc_ref.format.constants import LEVELS, RESIDUAL_ROWS
from quarc_ref.format.records import (
    LOG_SCALES,
    OPACITY,
    SH_DC,
    SH_REST,
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    StreamHeader,
)
from quarc_ref.format.updates import UPDATE_FIELDS, Updates
from quarc_ref.streams.stream_writer import StreamWriter

Float64 = NDArray[np.float64]

_METER = 1 << 12
_MOVERS = 8
_NONZERO_SHARE = 0.07
_FOLLOWING_SHARES = (0.10, 0.25, 0.45)
_FIELD_SHARE = 0.5
_EMPTY_SECTION = Section(np.zeros(0, dtype=np.uint32))


@dataclass(frozen=True, slots=True)
class Job:
    """Options of a generated stream.

    Attributes:
        gaussians: Number of Gaussians N of every frame.
        anchors_per: Gaussians per anchor of level 1.
        resample: Frames between samplings of anchors.
        births: Number of births and deaths of every frame.
        frames: Number of frames, including the canonical one.
        updated: Share of the Gaussians that every frame updates; 0 for a stream of version 1.0.
        sparse: Whether as few Gaussians follow a moving anchor as in streams of the real capture:
            10 % at level 1, 25 % at level 2, 45 % at level 3.
    """

    gaussians: int
    anchors_per: int = 4
    resample: int = 2
    births: int = 150
    frames: int = 101
    updated: float = 0.0
    sparse: bool = False

    def header(self) -> StreamHeader:
        """Return the header of a stream of the lowest sufficient level."""
        level = min(
            number for number, limits in LEVELS.items() if limits.gaussians >= self.gaussians
        )
        return StreamHeader(
            level=level,
            rotation_bits=6,
            log_scale_step=1 / 8,
            sh_dc_step=1 / 16,
            sh_rest_step=1 / 16,
            gaussians_per_anchor=self.anchors_per,
            resample_interval=self.resample,
            seed=1,
            updates=self.updated > 0,
        )


@dataclass(slots=True)
class _Movers:
    """Moving objects: positions, velocities and extents.

    Attributes:
        centers: `[3, m]` lattice units.
        velocities: `[c, m]` steps per frame.
        radii: Radius of an object's influence in lattice units, for each level.
    """

    centers: np.ndarray
    velocities: np.ndarray
    radii: tuple[float, ...]

    def advance(self, rng: np.random.Generator, step: int) -> None:
        noise = rng.normal(size=self.velocities.shape)
        noise *= self.velocities.std(axis=1, keepdims=True)
        self.velocities = 0.95 * self.velocities + 0.3 * noise
        self.centers = self.centers + step * self.velocities[:3]

    def draw_symbols(self, positions: Float64, number: int, seed: int) -> Int64:
        """Return symbols `[c, a]` of anchors at positions `[3, a]`."""
        distances = np.stack(
            [_compute_lengths(positions - center[:, None]) for center in self.centers.T]
        )
        nearest = distances.argmin(axis=0)
        is_moving = distances.min(axis=0) < self.radii[number]
        noise = np.random.default_rng(seed).normal(size=(self.velocities.shape[0], nearest.size))
        thirds = self.velocities[:, nearest] / 3 + 0.4 * noise
        symbols: Int64 = np.rint(thirds * is_moving).astype(np.int64)
        return symbols


def write_moving_stream(path: Path, job: Job) -> None:
    """Write the stream of a job; the file appears when it is complete."""
    with atomic_file(path) as sink:
        header = job.header()
        writer = StreamWriter(sink, wire.build_stream_header(header))
        for kind, payload in _make_chunks(header, job):
            writer.write(kind, payload)
        writer.finish()


def make_gaussians(count: int, rng: np.random.Generator) -> Gaussians:
    """Return the Gaussians of a scene; positions are in steps of 4 lattice units."""
    points = _make_points(count, rng) * _METER / 4
    coarse = np.floor(points / _METER).astype(np.int64)
    colors = (coarse * [[31], [17], [7]] % 23).sum(axis=0) - 30
    codes = np.zeros((16, count), dtype=np.int64)
    codes[LOG_SCALES] = -36 + rng.normal(0, 5, (1, count)) + rng.normal(0, 3, (3, count))
    codes[OPACITY] = rng.normal(12, 16, count).clip(-24, 60)
    codes[SH_DC] = colors + rng.normal(0, 5, (1, count)) + rng.normal(0, 1.5, (3, count))
    codes[SH_REST] = rng.laplace(0, 0.7, (9, count))
    rotations = np.concatenate([rng.integers(0, 4, (1, count)), _draw_thirds(count, rng)])
    return Gaussians(points.astype(np.int64), rotations, codes)


def _make_points(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return positions `[3, count]` in meters: in walls, furniture, clusters and outskirts."""
    walls = rng.uniform(-1, 1, (3, count)) * [[4], [2], [3]]
    side = rng.integers(0, 3, count)
    walls[side, np.arange(count)] = (
        np.where(rng.random(count) < 0.5, -1, 1) * np.array([4, 2, 3])[side]
    )
    walls += rng.normal(0, 0.01, walls.shape)
    directions = _normalize(rng.normal(size=(3, count)))
    object_indices = rng.integers(0, 40, count)
    furniture = (
        rng.uniform(-2, 2, (3, 40))[:, object_indices]
        + directions * rng.uniform(0.1, 0.5, (3, 40))[:, object_indices]
    )
    object_indices = rng.integers(0, 60, count)
    sizes = rng.uniform(0.01, 0.08, 60)[object_indices]
    clusters = rng.uniform(-2, 2, (3, 60))[:, object_indices] + rng.normal(size=(3, count)) * sizes
    outskirts = directions * np.exp(rng.uniform(np.log(5), np.log(400), count))
    kinds = np.stack([walls, furniture, clusters, outskirts])
    kind_indices = rng.choice(4, count, p=[0.38, 0.3, 0.2, 0.12])
    return kinds[kind_indices, :, np.arange(count)].T


def _draw_thirds(count: int, rng: np.random.Generator) -> Int64:
    """Return the three smallest components of unit quaternions, `[3, count]`, in steps of 1/64."""
    quaternions = np.sort(np.abs(_normalize(rng.normal(size=(4, count)))), axis=0)[:3]
    thirds: Int64 = np.trunc(quaternions * 64 * rng.choice([-1, 1], (3, count))).astype(np.int64)
    return thirds


def _make_births(state: FrameState, count: int, rng: np.random.Generator) -> Births:
    """Return births near random parents and similar to them."""
    parents = np.sort(rng.integers(0, state.scene.count, count))
    noise = rng.normal(0, 2, (16, count)).astype(np.int64)
    codes: Int64 = state.scene.codes[:, parents].astype(np.int64) + noise
    rotations = np.concatenate([rng.integers(0, 4, (1, count)), _draw_thirds(count, rng)])
    offsets = rng.laplace(0, 12, (3, count)).astype(np.int64)
    return Births(parents, Gaussians(offsets, rotations, codes))


def _make_chunks(header: StreamHeader, job: Job) -> Iterator[tuple[bytes, bytes]]:
    rng = np.random.default_rng(0)
    engine = choose_engine()
    state, payload = _make_canonical(engine, header, make_gaussians(job.gaussians, rng))
    yield container.CANO, payload
    movers = None
    for frame in range(1, job.frames):
        frame_start = engine.begin_frame(state, job.births)
        levels = [level.positions.astype(np.float64) for level in frame_start.known_anchors.levels]
        movers = movers or _make_movers(frame_start, levels, rng, sparse=job.sparse)
        symbols = [
            movers.draw_symbols(positions, number, 3 * frame + number)
            for number, positions in enumerate(levels)
        ]
        movers.advance(rng, header.translation_step)
        state, payload = _make_frame(engine, frame_start, symbols, job, rng)
        yield container.FRAM, payload


def _make_canonical(
    engine: Engine[Any], header: StreamHeader, gaussians: Gaussians
) -> tuple[FrameState, bytes]:
    origin, axis_bits, sorted_gaussians = sort_canonical(gaussians)
    state = engine.begin_canonical(header, 0, sorted_gaussians)
    sections = engine.write_canonical(sorted_gaussians, origin)
    crc = engine.state_crc(state)
    chunk = CanonicalChunk(0, sorted_gaussians.count, origin, axis_bits, sections, crc)
    return state, wire.build_canonical(chunk)


def _make_movers(
    state: FrameState, levels: list[np.ndarray], rng: np.random.Generator, *, sparse: bool
) -> _Movers:
    """Return movers whose radii move the requested share of Gaussians."""
    channels = np.arange(state.scene.header.symbol_planes)
    velocities = rng.normal(size=(channels.size, _MOVERS))
    velocities *= np.where(channels < 3, 5.0, 1.2)[:, None]
    inner_indices = np.flatnonzero(np.abs(state.scene.positions).max(axis=0) < 2 * _METER)
    centers = state.scene.positions[:, rng.choice(inner_indices, _MOVERS)].astype(np.float64)
    if not sparse:
        anchors = np.concatenate(levels, axis=1)
        radius = _find_radius(
            lambda radius: (
                _Movers(centers, velocities, (radius,)).draw_symbols(anchors, 0, 0) != 0
            ).mean(),
            _NONZERO_SHARE,
        )
        return _Movers(centers, velocities, (radius,) * len(levels))
    # The position of a Gaussian approximates that of the anchor that it follows.
    gaussians = state.scene.positions.astype(np.float64)
    radii = [
        _find_radius(
            lambda radius: (
                _Movers(centers, velocities, (radius,))
                .draw_symbols(gaussians, 0, 0)
                .any(axis=0)
                .mean()
            ),
            share,
        )
        for share in _FOLLOWING_SHARES
    ]
    return _Movers(centers, velocities, tuple(radii))


def _find_radius(measure_share: Callable[[float], float], target_share: float) -> float:
    low, high = 0.0, 8.0 * _METER
    for _ in range(10):
        radius = (low + high) / 2
        low, high = (low, radius) if measure_share(radius) > target_share else (radius, high)
    return low


def _make_updates(state: FrameState, share: float, rng: np.random.Generator) -> Updates:
    """Return updates with small residuals in some fields of random Gaussians, without deletions."""
    indices = np.flatnonzero(rng.random(state.scene.count) < share)
    residuals = rng.laplace(0, 2, (RESIDUAL_ROWS, indices.size)).astype(np.int64)
    for rows in UPDATE_FIELDS.values():
        residuals[rows] *= rng.random(indices.size) < _FIELD_SHARE
    return Updates(indices, np.zeros(indices.size, dtype=np.bool_), residuals)


def _make_frame(
    engine: Engine[Any],
    frame_start: FrameState,
    symbols: list[Int64],
    job: Job,
    rng: np.random.Generator,
) -> tuple[FrameState, bytes]:
    """Return the state of a frame and the payload of its chunk."""
    births, updates = job.births, None
    motion = engine.write_motion(frame_start, symbols, previous=True)
    moved_frame = engine.decode_motion(frame_start, motion, previous=True)
    if job.updated:
        frame_updates = _make_updates(moved_frame, job.updated, rng)
        updates = engine.write_updates(moved_frame, frame_updates)
        moved_frame = engine.decode_updates(moved_frame, updates)
    section = _EMPTY_SECTION
    if births:
        section = engine.write_births(moved_frame, _make_births(moved_frame, births, rng))
    state = engine.decode_births(moved_frame, section, births)
    crc = engine.state_crc(state)
    chunk = FrameChunk(state.scene.phase, True, births, births, motion, section, crc, updates)
    return state, wire.build_frame(chunk)


def _normalize(vectors: Float64) -> Float64:
    return vectors / _compute_lengths(vectors)


def _compute_lengths(vectors: Float64) -> Float64:
    lengths: Float64 = np.sqrt((vectors * vectors).sum(axis=0))
    return lengths
