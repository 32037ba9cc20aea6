"""Implements the command line of `benchmarks/rate.py`."""

import argparse
import json
from dataclasses import replace
from pathlib import Path

from options import add_capture_options, parse_positive
from quarc_ref.encoder.settings.presets import PRESETS
from rate.claims import (
    Claim,
    list_canonical_claims,
    list_fourdgs_claims,
    list_motion_claims,
    list_paper_claims,
)
from rate.jobs import BUILT_IN_CAPTURE, Job, trace_capture_if_missing
from rate.measure import MeasuredStream, measure
from rate.results import Results, write_files
from rate.rows import (
    STILL_FORMATS,
    Row,
    list_compressor_rows,
    list_fourdgs_rows,
    list_stream_rows,
    make_still_row,
)
from rate.sweep import make_hull_claim, measure_sweep

PAPER_PRESET = "paper"
_DESCRIPTION = (
    "Compare the size of streams with the paper's estimate, compressors and other splat formats."
)
# Maximum size of the canonical frame, relative to a file of the same scene in each format.
_MAX_STILL_SIZE_RATIOS = {"spz": 0.8, "sog": 1.0}


def measure_capture(job: Job, folder: Path, results: Results, *, with_paper: bool) -> None:
    """Measure a capture, and add its rows, claims and points to the results."""
    stream = measure(job, folder)
    stream_rows = list_stream_rows(stream)
    still_rows = {
        format_name: make_still_row(stream, format_name, folder) for format_name in STILL_FORMATS
    }
    fourdgs_rows = list_fourdgs_rows(stream)
    results.add(
        stream, [*stream_rows, *list_compressor_rows(stream), *still_rows.values(), *fourdgs_rows]
    )
    claims = list_motion_claims(stream.summary)
    for format_name, row in still_rows.items():
        claims += _list_still_claims(stream, row, _MAX_STILL_SIZE_RATIOS[format_name])
    if with_paper:
        paper_stream = measure(replace(job, preset=PAPER_PRESET, changes=()), folder)
        results.add(paper_stream, list_stream_rows(paper_stream))
        claims += list_paper_claims(
            stream.summary, stream.psnr, paper_stream.summary, paper_stream.psnr
        )
    claims += list_fourdgs_claims(stream.summary, fourdgs_rows[0].canonical, fourdgs_rows[0].total)
    results.claims[stream_rows[0].capture] = claims


def main() -> None:
    """Measure all captures given on the command line; write the files, and print the tables."""
    arguments = _parse_arguments()
    folder: Path = arguments.streams
    folder.mkdir(parents=True, exist_ok=True)
    results = Results()
    for name in arguments.captures:
        capture = trace_capture_if_missing(name, folder)
        held_out = tuple(arguments.held_out)
        job = Job(capture, arguments.preset, (), arguments.frames, arguments.downscale, held_out)
        measure_capture(job, folder, results, with_paper=not arguments.no_paper)
        if arguments.sweep:
            points = measure_sweep(
                replace(job, frames=arguments.sweep_frames or job.frames), folder
            )
            capture_name = capture.resolve().name
            results.points[capture_name] = points
            results.claims[capture_name].append(make_hull_claim(points))
        write_files(results, folder)
    if arguments.json:
        print(json.dumps(results.as_json(folder), indent=2))
    else:
        print(results.format_markdown())


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=_DESCRIPTION)
    add = parser.add_argument
    add(
        "captures",
        nargs="+",
        metavar="CAPTURE",
        help=f"folder of a capture, or {BUILT_IN_CAPTURE} for the playroom",
    )
    add(
        "--streams",
        type=Path,
        default=Path("out/rate"),
        metavar="DIR",
        help="folder for streams and tables; a run reuses the streams that it already contains",
    )
    add("--preset", choices=sorted(PRESETS), default="main")
    add_capture_options(parser)
    add(
        "--no-paper",
        action="store_true",
        help="do not compare with a stream of the preset `paper`",
    )
    add("--sweep", action="store_true", help="also measure variations of the preset's settings")
    add(
        "--sweep-frames",
        type=parse_positive,
        metavar="N",
        help="number of frames in each stream of --sweep",
    )
    add("--json", action="store_true", help="print JSON instead of tables")
    return parser.parse_args()


def _list_still_claims(stream: MeasuredStream, row: Row, bound: float) -> list[Claim]:
    other = None
    if row.canonical is not None and row.psnr_first is not None:
        other = (row.canonical, row.psnr_first)
    canonical_bytes = stream.summary.frames[0].coded_bytes["canonical"]
    return list_canonical_claims(canonical_bytes, stream.psnr[0], row.coder, other, bound)
