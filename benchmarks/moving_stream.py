"""Generates streams of simulated moving Gaussians to measure decoders; does not need torch.

The scene is a room with furniture, dense clusters and sparse surroundings, coded with the
quantization steps of preset `main`. A few objects move, each with its own steady motion. The
symbols of each of the three anchor levels code a third of the motion plus noise, rounded to whole
steps. In every frame, as many Gaussians die as are born.
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

_UNITS_PER_METER = 1 << 12
_MOVER_COUNT = 8
_NONZERO_SHARE = 0.07
_MOVING_GAUSSIAN_SHARES = (0.10, 0.25, 0.45)
_UPDATED_FIELD_SHARE = 0.5
_EMPTY_SECTION = Section(np.zeros(0, dtype=np.uint32))


@dataclass(frozen=True, slots=True)
class Job:
    """Options of a generated stream.

    Attributes:
        gaussians: Number of Gaussians in every frame.
        gaussians_per_anchor: Number of Gaussians per anchor of level 1.
        resample_interval: Number of frames between two samplings of anchors.
        births: Number of births, and also of deaths, in every frame after the first.
        frames: Number of frames, including the canonical one.
        updated_share: Share of the Gaussians that are updated in every frame; with 0, the stream
            has format 1.0.
        sparse: Whether only a few Gaussians are bound to moving anchors, as in streams of the real
            capture: 10 % at level 1, 25 % at level 2 and 45 % at level 3.
    """

    gaussians: int
    gaussians_per_anchor: int = 4
    resample_interval: int = 2
    births: int = 150
    frames: int = 101
    updated_share: float = 0.0
    sparse: bool = False

    def make_header(self) -> StreamHeader:
        """Return the stream header, with the lowest level that allows this number of Gaussians."""
        level = min(
            number for number, limits in LEVELS.items() if limits.gaussians >= self.gaussians
        )
        return StreamHeader(
            level=level,
            rotation_bits=6,
            log_scale_step=1 / 8,
            sh_dc_step=1 / 16,
            sh_rest_step=1 / 16,
            gaussians_per_anchor=self.gaussians_per_anchor,
            resample_interval=self.resample_interval,
            seed=1,
            updates=self.updated_share > 0,
        )


@dataclass(slots=True)
class _Movers:
    """Moving objects: their centers, velocities and radii.

    Attributes:
        centers: `[3, m]` centers in lattice units.
        velocities: `[c, m]` velocities in quantization steps per frame.
        radii: For each anchor level, the radius around a center, in lattice units, in which anchors
            move with the object.
    """

    centers: np.ndarray
    velocities: np.ndarray
    radii: tuple[float, ...]

    def advance(self, rng: np.random.Generator, translation_step: int) -> None:
        noise = rng.normal(size=self.velocities.shape)
        noise *= self.velocities.std(axis=1, keepdims=True)
        self.velocities = 0.95 * self.velocities + 0.3 * noise
        self.centers = self.centers + translation_step * self.velocities[:3]

    def make_symbols(self, positions: Float64, level_index: int, seed: int) -> Int64:
        """Return the symbols `[c, a]` of the anchors at positions `[3, a]`, all of one level."""
        distances = np.stack(
            [_compute_lengths(positions - center[:, None]) for center in self.centers.T]
        )
        nearest = distances.argmin(axis=0)
        is_moving = distances.min(axis=0) < self.radii[level_index]
        noise = np.random.default_rng(seed).normal(size=(self.velocities.shape[0], nearest.size))
        level_motion = self.velocities[:, nearest] / 3 + 0.4 * noise
        symbols: Int64 = np.rint(level_motion * is_moving).astype(np.int64)
        return symbols


def write_moving_stream(path: Path, job: Job) -> None:
    """Write a job's stream; the file becomes visible only when it is complete."""
    with atomic_file(path) as sink:
        header = job.make_header()
        writer = StreamWriter(sink, wire.build_stream_header(header))
        for kind, payload in _make_chunks(header, job):
            writer.write(kind, payload)
        writer.finish()


def make_gaussians(count: int, rng: np.random.Generator) -> Gaussians:
    """Return the Gaussians of a scene; positions are in steps of 4 lattice units."""
    points = _make_points(count, rng) * _UNITS_PER_METER / 4
    cells = np.floor(points / _UNITS_PER_METER).astype(np.int64)
    colors = (cells * [[31], [17], [7]] % 23).sum(axis=0) - 30
    codes = np.zeros((16, count), dtype=np.int64)
    codes[LOG_SCALES] = -36 + rng.normal(0, 5, (1, count)) + rng.normal(0, 3, (3, count))
    codes[OPACITY] = rng.normal(12, 16, count).clip(-24, 60)
    codes[SH_DC] = colors + rng.normal(0, 5, (1, count)) + rng.normal(0, 1.5, (3, count))
    codes[SH_REST] = rng.laplace(0, 0.7, (9, count))
    rotations = np.concatenate([rng.integers(0, 4, (1, count)), _make_small_components(count, rng)])
    return Gaussians(points.astype(np.int64), rotations, codes)


def _make_points(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return positions `[3, count]` in meters: walls, furniture, clusters and surroundings."""
    walls = rng.uniform(-1, 1, (3, count)) * [[4], [2], [3]]
    axes = rng.integers(0, 3, count)
    walls[axes, np.arange(count)] = (
        np.where(rng.random(count) < 0.5, -1, 1) * np.array([4, 2, 3])[axes]
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
    surroundings = directions * np.exp(rng.uniform(np.log(5), np.log(400), count))
    points_by_kind = np.stack([walls, furniture, clusters, surroundings])
    kind_indices = rng.choice(4, count, p=[0.38, 0.3, 0.2, 0.12])
    return points_by_kind[kind_indices, :, np.arange(count)].T


def _make_small_components(count: int, rng: np.random.Generator) -> Int64:
    """Return the small components `[3, count]` of random unit quaternions, in units of 1/64."""
    magnitudes = np.sort(np.abs(_normalize(rng.normal(size=(4, count)))), axis=0)[:3]
    signs = rng.choice([-1, 1], (3, count))
    components: Int64 = np.trunc(magnitudes * 64 * signs).astype(np.int64)
    return components


def _make_births(state: FrameState, count: int, rng: np.random.Generator) -> Births:
    """Return births whose positions and attributes are close to those of random parents."""
    parents = np.sort(rng.integers(0, state.scene.count, count))
    noise = rng.normal(0, 2, (16, count)).astype(np.int64)
    codes: Int64 = state.scene.codes[:, parents].astype(np.int64) + noise
    rotations = np.concatenate([rng.integers(0, 4, (1, count)), _make_small_components(count, rng)])
    offsets = rng.laplace(0, 12, (3, count)).astype(np.int64)
    return Births(parents, Gaussians(offsets, rotations, codes))


def _make_chunks(header: StreamHeader, job: Job) -> Iterator[tuple[bytes, bytes]]:
    rng = np.random.default_rng(0)
    engine = choose_engine()
    state, payload = _make_canonical_frame(engine, header, make_gaussians(job.gaussians, rng))
    yield container.CANO, payload
    movers = None
    for frame in range(1, job.frames):
        frame_start = engine.begin_frame(state, job.births)
        level_positions = [
            level.positions.astype(np.float64) for level in frame_start.required_anchors.levels
        ]
        movers = movers or _make_movers(frame_start, level_positions, rng, sparse=job.sparse)
        symbols = [
            movers.make_symbols(positions, index, 3 * frame + index)
            for index, positions in enumerate(level_positions)
        ]
        movers.advance(rng, header.translation_step)
        state, payload = _make_frame(engine, frame_start, symbols, job, rng)
        yield container.FRAM, payload


def _make_canonical_frame(
    engine: Engine[Any], header: StreamHeader, gaussians: Gaussians
) -> tuple[FrameState, bytes]:
    origin, axis_bits, sorted_gaussians = sort_canonical(gaussians)
    state = engine.begin_canonical(header, 0, sorted_gaussians)
    sections = engine.write_canonical(sorted_gaussians, origin)
    crc = engine.state_crc(state)
    chunk = CanonicalChunk(0, sorted_gaussians.count, origin, axis_bits, sections, crc)
    return state, wire.build_canonical(chunk)


def _make_movers(
    state: FrameState, level_positions: list[np.ndarray], rng: np.random.Generator, *, sparse: bool
) -> _Movers:
    """Return movers whose radii give the intended share of nonzero symbols or moving Gaussians."""
    channels = np.arange(state.scene.header.symbol_planes)
    velocities = rng.normal(size=(channels.size, _MOVER_COUNT))
    velocities *= np.where(channels < 3, 5.0, 1.2)[:, None]
    inner_indices = np.flatnonzero(np.abs(state.scene.positions).max(axis=0) < 2 * _UNITS_PER_METER)
    centers = state.scene.positions[:, rng.choice(inner_indices, _MOVER_COUNT)].astype(np.float64)
    if not sparse:
        anchors = np.concatenate(level_positions, axis=1)
        radius = _find_radius(
            lambda radius: (
                _Movers(centers, velocities, (radius,)).make_symbols(anchors, 0, 0) != 0
            ).mean(),
            _NONZERO_SHARE,
        )
        return _Movers(centers, velocities, (radius,) * len(level_positions))
    # The position of a Gaussian approximates that of the anchor that it follows.
    gaussians = state.scene.positions.astype(np.float64)
    radii = [
        _find_radius(
            lambda radius: (
                _Movers(centers, velocities, (radius,))
                .make_symbols(gaussians, 0, 0)
                .any(axis=0)
                .mean()
            ),
            share,
        )
        for share in _MOVING_GAUSSIAN_SHARES
    ]
    return _Movers(centers, velocities, tuple(radii))


def _find_radius(measure_share: Callable[[float], float], target_share: float) -> float:
    low, high = 0.0, 8.0 * _UNITS_PER_METER
    for _ in range(10):
        radius = (low + high) / 2
        low, high = (low, radius) if measure_share(radius) > target_share else (radius, high)
    return low


def _make_updates(state: FrameState, share: float, rng: np.random.Generator) -> Updates:
    """Return updates of random Gaussians: small residuals in some fields, and no deletions."""
    indices = np.flatnonzero(rng.random(state.scene.count) < share)
    residuals = rng.laplace(0, 2, (RESIDUAL_ROWS, indices.size)).astype(np.int64)
    for rows in UPDATE_FIELDS.values():
        residuals[rows] *= rng.random(indices.size) < _UPDATED_FIELD_SHARE
    return Updates(indices, np.zeros(indices.size, dtype=np.bool_), residuals)


def _make_frame(
    engine: Engine[Any],
    frame_start: FrameState,
    symbols: list[Int64],
    job: Job,
    rng: np.random.Generator,
) -> tuple[FrameState, bytes]:
    """Return the state after a frame, and the payload of the frame's chunk."""
    births, updates = job.births, None
    motion = engine.write_motion(frame_start, symbols, use_previous=True)
    moved_frame = engine.decode_motion(frame_start, motion, use_previous=True)
    if job.updated_share:
        frame_updates = _make_updates(moved_frame, job.updated_share, rng)
        updates = engine.write_updates(moved_frame, frame_updates)
        moved_frame = engine.decode_updates(moved_frame, updates)
    births_section = _EMPTY_SECTION
    if births:
        births_section = engine.write_births(moved_frame, _make_births(moved_frame, births, rng))
    state = engine.decode_births(moved_frame, births_section, births)
    crc = engine.state_crc(state)
    chunk = FrameChunk(
        state.scene.phase, True, births, births, motion, births_section, crc, updates
    )
    return state, wire.build_frame(chunk)


def _normalize(vectors: Float64) -> Float64:
    return vectors / _compute_lengths(vectors)


def _compute_lengths(vectors: Float64) -> Float64:
    lengths: Float64 = np.sqrt((vectors * vectors).sum(axis=0))
    return lengths
