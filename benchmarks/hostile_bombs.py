"""Measures the time and memory of decoding small streams that reach the limits of their level.

    python benchmarks/hostile_bombs.py [--engine reference] [--json]

The conformance level of a stream limits its numbers of Gaussians and births. The size of the stream
does not limit them, because a coded bit can take almost no space. Each stream is decoded in a
separate process. Times are processor times, without the loading and compiling of the decoder.
"""

import argparse
import io
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from atomic_files import write_atomically
from quarc_ref.decoder.engine import FAST, REFERENCE
from quarc_ref.decoder.engines import find_fast_engine, use_engine
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from quarc_ref.inspection.peak_memory import measure_peak_mebibytes
from quarc_ref.streams import decode
from rate.tables import format_table

_FRAME_COUNT = 4
_EXTENT = 1 << 20
_LEVELS = (10, 20, 30)
_HEADER = (
    "conformance level x 10 and contents",
    "bytes",
    "slowest frame in s",
    "peak memory in MiB",
)
_MAX_STREAM_BYTES = 1 << 20
_WARM_UP_STREAM = (
    Path(__file__).parents[1] / "tests" / "hostile" / "seeds" / "streams" / "full.quarc"
)


def _place_at_one_point(count: int) -> Int64:
    return np.zeros((3, count), dtype=np.int64)


def _place_on_a_sphere(count: int) -> Int64:
    points = np.random.default_rng(0).normal(size=(3, count))
    points *= 0.4 * _EXTENT / np.linalg.norm(points, axis=0)
    return points.astype(np.int64)


def _place_half_in_a_corner(count: int) -> Int64:
    """Return positions, of which half are spread over many cells and half are in a single cell."""
    rng = np.random.default_rng(0)
    points = rng.integers(0, _EXTENT, (3, count))
    points[:, count // 2 :] = rng.integers(0, 64, (3, count - count // 2))
    return points


_ARRANGEMENTS: dict[str, Callable[[int], Int64]] = {
    "all at one position": _place_at_one_point,
    "on a sphere": _place_on_a_sphere,
    "half in a corner": _place_half_in_a_corner,
}


def build_stream(level: int, arrangement: str, *, has_births: bool) -> bytes:
    """Return a stream with the maximum number of Gaussians of its level, each with its own anchor.

    Args:
        level: Conformance level of the stream.
        arrangement: Where the Gaussians are; a key of `_ARRANGEMENTS`.
        has_births: Whether each frame has the maximum number of births.
    """
    births = LEVELS[level].births if has_births else 0
    header = StreamHeader(level=level, gaussians_per_anchor=1, anchor_ratio=2)
    sink = io.BytesIO()
    loop = ClosedLoop(sink, header, (), {})
    count = LEVELS[level].gaussians - (_FRAME_COUNT - 1) * births
    loop.commit_canonical(_make_gaussians(header, _ARRANGEMENTS[arrangement](count)), 0)
    for _ in range(1, _FRAME_COUNT):
        frame_start = loop.start_frame(0)
        levels = frame_start.state.required_anchors.levels
        symbols = [
            np.zeros((6, level_anchors.owners.size), dtype=np.int64) for level_anchors in levels
        ]
        moved_frame = loop.move_frame(frame_start, symbols)
        zeros = np.zeros((3, births), dtype=np.int64)
        loop.commit_frame(
            moved_frame, Births(zeros[0], _make_gaussians(header, zeros)) if births else None
        )
    loop.finish()
    return sink.getvalue()


def _make_gaussians(header: StreamHeader, positions: Int64) -> Gaussians:
    zeros = np.zeros((4 + header.code_planes, positions.shape[1]), dtype=np.int64)
    return Gaussians(positions, zeros[:4], zeros[4:])


def measure(path: Path, engine: str) -> dict[str, float | None]:
    """Decode a stream; return the time of its slowest frame in seconds, and the peak memory."""
    with use_engine(engine):
        list(decode(_WARM_UP_STREAM.read_bytes()))
        times = [time.process_time()]
        for _ in decode(path.read_bytes()):
            times.append(time.process_time())  # noqa: PERF401, each as it comes
    slowest = max(end - start for start, end in pairwise(times))
    peak = measure_peak_mebibytes()
    return {
        "slowest_frame_s": round(slowest, 2),
        "peak_rss_mib": None if peak is None else round(peak),
    }


def main() -> None:
    """Build all streams, and measure those of at most 1 MiB."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--engine", choices=(FAST, REFERENCE), default=FAST)
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/bombs"),
        metavar="DIR",
        help="folder for streams; a run measures the streams that are already there",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--measure", type=Path, metavar="FILE", help="measure only this stream")
    arguments = parser.parse_args()
    if arguments.engine == FAST and find_fast_engine() is None:
        parser.error("the fast engine is not installed: see core/README.md, or use --engine")
    if arguments.measure:
        print(json.dumps(measure(arguments.measure, arguments.engine)))
        return
    rows = list(_measure_streams(arguments.out, arguments.engine))
    if arguments.json:
        print(json.dumps(rows, indent=2))
    else:
        print(
            format_table(_HEADER, [[str(value) for value in row.values()] for row in rows]), end=""
        )


def _measure_streams(folder: Path, engine: str) -> Iterator[dict[str, object]]:
    for level, arrangement, has_births in product(_LEVELS, _ARRANGEMENTS, (False, True)):
        path = folder / f"{level} {arrangement}{' with births' * has_births}.quarc"
        if not path.exists():
            write_atomically(path, build_stream(level, arrangement, has_births=has_births))
        size = path.stat().st_size
        if size <= _MAX_STREAM_BYTES:
            command = [sys.executable, __file__, "--engine", engine, "--measure", str(path)]
            process = subprocess.run(command, stdout=subprocess.PIPE, check=True)
            yield {"stream": path.stem, "bytes": size, **json.loads(process.stdout)}


if __name__ == "__main__":
    main()
