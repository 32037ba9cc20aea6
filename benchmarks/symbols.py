"""Measures how long one thread takes to decode all symbols of a frame.

    python benchmarks/symbols.py [--gaussians N] [--births N] [--repeats N] [--json]

The symbols are simulated: a few objects move, each with its own steady motion, and the symbols of
each anchor level code a third of the motion plus noise. The symbols therefore correlate with those
of parent anchors and of the previous frame, as in a trained stream. The radius of the moving
objects is chosen such that the requested share of symbols is nonzero.
"""

import argparse
import json
import platform
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from statistics import median
from time import perf_counter, process_time
from typing import Any

import numpy as np

from options import parse_count, parse_positive
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.reconstruct import begin_frame, motion_contexts, move
from quarc_ref.decoder.state import State
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.ans import PythonBitDecoder
from quarc_ref.format.coding.entropy import HAS_CONSTRICTION, make_fastest_decoder, use_bit_decoder
from quarc_ref.format.coding.gaussian_planes import read_births, write_births
from quarc_ref.format.coding.motion_planes import read_motion, write_motion
from quarc_ref.format.records import Births, Gaussians, StreamHeader

CountsByField = dict[str, Any]  # context counts, indexed by the fields of a state

REGIMES = {"paper": 0.07, "sparse": 0.01}  # share of nonzero symbols
_MOVER_COUNT = 8
_HEADER = StreamHeader(
    level=20, level_count=3, gaussians_per_anchor=4, anchor_ratio=3, resample_interval=1
)


@dataclass(frozen=True, slots=True, eq=False)
class SceneMotion:
    """Moving objects ("movers"), and the distance of each Gaussian from the nearest mover.

    Attributes:
        distances: `[N]` distance of each Gaussian from its nearest mover, in lattice units.
        nearest_movers: `[N]` index of the nearest mover of each Gaussian.
        velocities: `[c, m]` velocity of each mover in quantization steps per frame.
    """

    distances: np.ndarray
    nearest_movers: Int64
    velocities: np.ndarray

    def advance(self, rng: np.random.Generator) -> "SceneMotion":
        """Return the motion in the next frame, which has slightly different velocities."""
        noise = rng.normal(size=self.velocities.shape) * self.velocities.std(axis=1, keepdims=True)
        return SceneMotion(
            self.distances, self.nearest_movers, 0.95 * self.velocities + 0.3 * noise
        )


def make_canonical(count: int, rng: np.random.Generator) -> State:
    """Return a canonical frame of clusters in a room."""
    centers = rng.uniform(-3000, 3000, (3, 60))
    positions = centers[:, rng.integers(0, 60, count)] + rng.normal(size=(3, count)) * 300
    rotations = np.zeros((4, count), dtype=np.int64)
    codes = np.zeros((_HEADER.code_planes, count), dtype=np.int64)
    return begin_canonical(_HEADER, 0, Gaussians(positions.astype(np.int64), rotations, codes))


def make_scene_motion(state: State, rng: np.random.Generator) -> SceneMotion:
    """Return motion with movers at the positions of random Gaussians and random velocities."""
    positions = state.scene.positions.astype(np.float64)
    centers = positions[:, rng.integers(0, state.scene.count, _MOVER_COUNT)]
    distances = np.stack(
        [np.linalg.norm(positions - center[:, None], axis=0) for center in centers.T]
    )
    velocities = rng.normal(size=(_HEADER.symbol_planes, _MOVER_COUNT))
    velocities *= np.where(np.arange(_HEADER.symbol_planes) < 3, 5.0, 1.2)[:, None]
    return SceneMotion(distances.min(axis=0), distances.argmin(axis=0), velocities)


def make_symbols(state: State, motion: SceneMotion, share: float) -> list[Int64]:
    """Return the symbols of each anchor level, of which about the requested share is nonzero.

    Args:
        state: State after `begin_frame`.
        motion: Motion of the scene.
        share: Requested share; the actual share is smaller if not enough symbols are nonzero even
            when all anchors move.
    """
    low, high = 0.0, float(motion.distances.max())
    for _ in range(12):
        radius = (low + high) / 2
        too_many = compute_nonzero_share(_make_symbols_for_radius(state, motion, radius)) > share
        low, high = (low, radius) if too_many else (radius, high)
    return _make_symbols_for_radius(state, motion, low)


def compute_nonzero_share(symbols: list[Int64]) -> float:
    """Return the share of symbols that are not 0."""
    return float(np.mean(np.concatenate(symbols, axis=1) != 0))


def make_births(state: State, count: int, rng: np.random.Generator) -> Births:
    """Return births near random parents."""

    def sample_laplace(rows: int, scale: float) -> Int64:
        return rng.laplace(0, scale, (rows, count)).astype(np.int64)

    rotations = np.concatenate(
        [rng.integers(0, 4, (1, count)), sample_laplace(3, 30).clip(-128, 128)]
    )
    residuals = Gaussians(sample_laplace(3, 12), rotations, sample_laplace(_HEADER.code_planes, 4))
    return Births(np.sort(rng.integers(0, state.scene.count, count)), residuals)


def encode_symbols(
    state: State, symbols: list[Int64], births: Births
) -> tuple[Callable[[], CountsByField], int]:
    """Encode the symbols of a frame.

    Returns:
        A function that decodes the symbols and returns the new context counts; and the number of
        coded bytes.
    """
    levels = motion_contexts(state, use_previous=True)
    motion = write_motion(levels, symbols, state.motion_counts)
    decoded, _ = read_motion(motion, levels, state.motion_counts)
    births_section = write_births(births, state.birth_counts)
    birth_count, plane_count = births.newborn.count, _HEADER.code_planes
    if not all(map(np.array_equal, decoded, symbols)):
        message = "the decoded symbols differ from the encoded symbols"
        raise RuntimeError(message)

    def decode() -> CountsByField:
        _, motion_counts = read_motion(motion, levels, state.motion_counts)
        _, birth_counts = read_births(births_section, plane_count, birth_count, state.birth_counts)
        return {"motion_counts": motion_counts, "birth_counts": birth_counts}

    return decode, motion.byte_count() + births_section.byte_count()


def time_regime(state: State, share: float, births: int, repeats: int) -> list[dict[str, object]]:
    """Return a row for each entropy decoder, with its time for the second of two moving frames."""
    rng = np.random.default_rng(1)
    motion = make_scene_motion(state, rng)
    start = begin_frame(state, 0)
    symbols = make_symbols(start, motion, share)
    decode, _ = encode_symbols(start, symbols, make_births(start, births, rng))
    start = begin_frame(replace(move(start, symbols), **decode()), 0)
    symbols = make_symbols(start, motion.advance(rng), share)
    decode, size = encode_symbols(start, symbols, make_births(start, births, rng))
    shared_columns = {
        "anchors": sum(level.shape[1] for level in symbols),
        "nonzero": compute_nonzero_share(symbols),
        "bytes": size,
    }
    rows: list[dict[str, object]] = []
    for name, decoder_context in make_decoder_contexts().items():
        with decoder_context:
            rows.append({"reader": name, **shared_columns, **time_calls(decode, repeats)})
    return rows


def make_decoder_contexts() -> dict[str, AbstractContextManager[None]]:
    """Return for each entropy decoder a context manager that selects it; fastest first."""
    decoder_contexts: dict[str, AbstractContextManager[None]] = {}
    if HAS_CONSTRICTION:
        decoder_contexts["constriction"] = use_bit_decoder(make_fastest_decoder)
    decoder_contexts["python"] = use_bit_decoder(PythonBitDecoder)
    return decoder_contexts


def time_calls(call: Callable[[], object], repeats: int) -> dict[str, float]:
    """Return the median times of a call in milliseconds: elapsed time and processor time.

    Both times are about equal if no other process uses the processor.
    """
    times = []
    for _ in range(repeats):
        start_time, start_cpu = perf_counter(), process_time()
        call()
        times.append((perf_counter() - start_time, process_time() - start_cpu))
    elapsed_times, cpu_times = zip(*times, strict=True)
    return {"ms": 1e3 * median(elapsed_times), "cpu_ms": 1e3 * median(cpu_times)}


def main() -> None:
    """Time both regimes with every entropy decoder, and print the rows."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--gaussians", type=parse_positive, default=244_000)
    parser.add_argument("--births", type=parse_count, default=150)
    parser.add_argument("--repeats", type=parse_positive, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    state = make_canonical(arguments.gaussians, np.random.default_rng(0))
    rows = [
        {"regime": regime, **row}
        for regime, share in REGIMES.items()
        for row in time_regime(state, share, arguments.births, arguments.repeats)
    ]
    if arguments.json:
        machine = platform.processor() or platform.machine()
        print(json.dumps({"machine": machine, "births": arguments.births, "rows": rows}, indent=2))
        return
    print("| regime | anchors | nonzero symbols | bytes | entropy decoder | ms | CPU ms |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        print(
            f"| {row['regime']} | {row['anchors']:,} | {row['nonzero']:.1%} | {row['bytes']:,} | "
            f"{row['reader']} | {row['ms']:.1f} | {row['cpu_ms']:.1f} |"
        )


def _make_symbols_for_radius(state: State, motion: SceneMotion, radius: float) -> list[Int64]:
    """Return the symbols if all movers have this radius; every call adds the same noise."""
    rng, symbols = np.random.default_rng(2), []
    for level in state.required_anchors.levels:
        gaussian_indices = np.searchsorted(state.scene.ids, level.owners)
        level_motion = motion.velocities[:, motion.nearest_movers[gaussian_indices]] / 3
        is_moving = motion.distances[gaussian_indices] < radius
        noise = rng.normal(size=level_motion.shape) * 0.4
        symbols.append(np.rint((level_motion + noise) * is_moving).astype(np.int64))
    return symbols


if __name__ == "__main__":
    main()
