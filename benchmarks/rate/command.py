"""The command line of benchmarks/rate.py."""

import argparse
import json
from dataclasses import replace
from pathlib import Path

from options import add_capture_options
from quarc_ref.encoder.settings.presets import PRESETS
from rate.claims import (
    Claim,
    claim_against_paper,
    claim_canonical,
    claim_fourdgs,
    claim_motion,
)
from rate.jobs import BUILT_IN, Job, trace_capture_if_missing
from rate.measure import Measured, measure
from rate.results import Results, write_files
from rate.rows import (
    STILL_FORMATS,
    Row,
    list_fourdgs_rows,
    list_generic_rows,
    list_own_rows,
    make_still_row,
)
from rate.sweep import claim_hull, sweep

PAPER = "paper"
_WHAT = (
    "Compare the size of streams with the paper's estimate, compressors and other splat formats."
)
_STILL_BOUNDS = {"spz": 0.8, "sog": 1.0}


def compare(job: Job, folder: Path, results: Results, *, with_paper: bool) -> None:
    """Add the rows and the claims of a capture."""
    mine = measure(job, folder)
    own = list_own_rows(mine)
    still = {ending: make_still_row(mine, ending, folder) for ending in STILL_FORMATS}
    fourdgs = list_fourdgs_rows(mine)
    results.add(mine, [*own, *list_generic_rows(mine), *still.values(), *fourdgs])
    claims = claim_motion(mine.summary)
    for ending, row in still.items():
        claims += _claim_still(mine, row, _STILL_BOUNDS[ending])
    if with_paper:
        paper = measure(replace(job, preset=PAPER, changes=()), folder)
        results.add(paper, list_own_rows(paper))
        claims += claim_against_paper(mine.summary, mine.psnr, paper.summary, paper.psnr)
    claims += claim_fourdgs(mine.summary, fourdgs[0].canonical, fourdgs[0].total)
    results.claims[own[0].capture] = claims


def main() -> None:
    """Make the tables of all captures given on the command line."""
    arguments = _parse_arguments()
    folder: Path = arguments.streams
    folder.mkdir(parents=True, exist_ok=True)
    results = Results()
    for name in arguments.captures:
        capture = trace_capture_if_missing(name, folder)
        held_out = tuple(arguments.held_out)
        job = Job(capture, arguments.preset, (), arguments.frames, arguments.downscale, held_out)
        compare(job, folder, results, with_paper=not arguments.no_paper)
        if arguments.sweep:
            points = sweep(replace(job, frames=arguments.sweep_frames or job.frames), folder)
            title = capture.resolve().name
            results.points[title] = points
            results.claims[title].append(claim_hull(points))
        write_files(results, folder)
    if arguments.json:
        print(json.dumps(results.as_json(folder), indent=2))
    else:
        print(results.markdown())


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=_WHAT)
    add = parser.add_argument
    add("captures", nargs="+", metavar="CAPTURE", help=f"a folder, or {BUILT_IN}")
    add("--streams", type=Path, default=Path("out/rate"), metavar="DIR", help="kept between runs")
    add("--preset", choices=sorted(PRESETS), default="main")
    add_capture_options(parser)
    add("--no-paper", action="store_true", help="leave out the stream of the preset paper")
    add("--sweep", action="store_true", help="rate and quality of settings around the preset")
    add("--sweep-frames", type=int, metavar="N", help="number of frames of the sweep's streams")
    add("--json", action="store_true", help="print JSON instead of tables")
    return parser.parse_args()


def _claim_still(mine: Measured, row: Row, bound: float) -> list[Claim]:
    theirs = None
    if row.canonical is not None and row.psnr_first is not None:
        theirs = (row.canonical, row.psnr_first)
    coded = mine.summary.frames[0].coded_bytes["canonical"]
    return claim_canonical(coded, mine.psnr[0], row.coder, theirs, bound)
