"""Measures the speed and memory of the decoder on generated streams with many Gaussians.

    python benchmarks/decode.py --gaussians N --anchors-per 4 --resample 2 --threads 2 --json
    python benchmarks/decode.py --table

The stream is generated once by `moving_stream` and kept in `--cache`. `quarc-ref bench` decodes it
in a separate process with the fast engine, or with the reference engine if `--reference` is given.
`stolen` is the share of the needed processor time that the host gave to other virtual machines. If
this share is large, the times are not reliable.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import moving_stream
from moving_stream import Job, write_moving_stream
from options import parse_count, parse_positive
from quarc_ref.decoder.engines import find_fast_engine

GAUSSIAN_COUNTS = (20_000, 100_000, 244_000, 1_000_000)
_FRAMES_BY_SIZE = {1_000_000: 21}


def make_stream(job: Job, cache: Path) -> Path:
    """Return the path of a job's stream; generate the stream if it is not in the cache."""
    cache.mkdir(parents=True, exist_ok=True)
    source = Path(moving_stream.__file__).read_bytes()
    digest = hashlib.sha256(source + repr(job).encode()).hexdigest()[:16]
    path = cache / f"moving-{job.gaussians}-{digest}.quarc"
    if not path.exists():
        write_moving_stream(path, job)
    return path


def measure(path: Path, threads: int, engine: str) -> dict[str, Any]:
    """Return the result of `quarc-ref bench`, run in a separate process."""
    command = [sys.executable, "-m", "quarc_ref", "bench", str(path), "--threads", str(threads)]
    process = subprocess.run(
        [*command, "--json", "--quiet"],
        env={**os.environ, "QUARC_REF_ENGINE": engine},
        check=True,
        stdout=subprocess.PIPE,  # errors are shown
    )
    result: dict[str, Any] = json.loads(process.stdout)
    return result


def measure_all(cache: Path, births: int) -> list[dict[str, Any]]:
    """Measure every size as a dense and a sparse stream, with 1 and 2 threads; return the rows."""
    rows = []
    for size in GAUSSIAN_COUNTS:
        for sparse in (False, True):
            job = Job(size, births=births, frames=_FRAMES_BY_SIZE.get(size, 101), sparse=sparse)
            path = make_stream(job, cache)
            rows += [
                {"stream": "sparse" if sparse else "dense", **measure(path, threads, "fast")}
                for threads in (1, 2)
            ]
    return rows


def format_table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a Markdown table."""
    stages = list(dict.fromkeys(stage for row in rows for stage in row["ms_by_stage"]))
    lines = [
        [
            "Gaussians",
            "stream",
            "engine",
            "threads",
            "fps",
            "ms per frame",
            "CPU ms per frame",
            "stolen",
            *stages,
            "first frame, s",
            "first frame after warm-up, s",
            "peak memory, MiB",
        ]
    ]
    for row in rows:
        stage_times = [f"{row['ms_by_stage'].get(stage, 0):.1f}" for stage in stages]
        stolen_share = row["stolen_share"]
        stolen_text = "unknown" if stolen_share is None else f"{stolen_share:.0%}"
        lines.append([
            f"{row['gaussians']:,}", row.get("stream", ""), row["engine"], str(row["threads"]),
            f"{row['fps']:.1f}", f"{1e3 / row['fps']:.1f}", f"{row['cpu_ms']:.1f}",
            stolen_text, *stage_times,
            f"{row['first_frame_s']:.2f}", f"{row['warm_first_frame_s']:.2f}",
            f"{row['peak_rss_mib']:.0f}",
        ])  # fmt: skip
    lines.insert(1, ["---"] * len(lines[0]))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    """Measure one stream, or streams of all sizes with `--table`, and print the rows."""
    options = _parse_arguments()
    if options.table:
        rows = measure_all(options.cache, options.births)
    else:
        stream_options = (options.gaussians, options.anchors_per, options.resample, options.births)
        job = Job(*stream_options, options.frames, options.updated, options.sparse)
        path = make_stream(job, options.cache)
        engine = "reference" if options.reference else "fast"
        rows = [measure(path, options.threads, engine)]
    if options.json:
        print(json.dumps(rows if options.table else rows[0], indent=2))
    else:
        print(format_table(rows))


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add, default_cache = parser.add_argument, Path(tempfile.gettempdir()) / "quarc-ref-streams"
    add("--births", type=parse_count, default=150, help="number of births in each frame")
    single_stream_options = [
        add("--gaussians", type=parse_positive, default=244_000),
        add("--anchors-per", type=parse_positive, default=4, help="Gaussians per anchor"),
        add("--resample", type=parse_positive, default=2, help="resampling interval in frames"),
        add("--frames", type=parse_positive, default=101),
        add("--updated", type=float, default=0.0, help="share of the Gaussians that are updated "
            "in each frame"),
        add("--threads", type=parse_positive, default=2),
        add("--sparse", action="store_true", help="move as few Gaussians as in streams of real "
            "captures"),
        add("--reference", action="store_true", help="decode with the reference engine"),
    ]  # fmt: skip
    add("--table", action="store_true", help="measure streams of all sizes, with 1 and 2 threads")
    add("--json", action="store_true")
    add("--cache", type=Path, default=default_cache, help="folder for generated streams")
    options = parser.parse_args()
    for option in single_stream_options:
        if options.table and getattr(options, option.dest) != option.default:
            parser.error(f"{option.option_strings[0]} cannot be combined with --table")
    if options.frames < 2 or not 0 <= options.updated <= 1:
        parser.error("--frames must be at least 2, and --updated a number from 0 to 1")
    if options.births > options.gaussians:
        parser.error("--births must be at most --gaussians")
    if not options.reference and find_fast_engine() is None:
        parser.error("the fast engine is not installed: see core/README.md, or use --reference")
    return options


if __name__ == "__main__":
    main()
