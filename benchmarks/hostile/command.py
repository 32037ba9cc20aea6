"""The command line of benchmarks/hostile.py."""

import argparse
import hashlib
import json
import os
import sys
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

# Set before NumPy is loaded, because the memory of its threads would count towards the limit.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hostile import judge
from hostile.blocks import BLOCK_SIZE, Series, Tally, append_block, judge_block, read_blocks
from hostile.mutations import Mutator
from hostile.structured.maker import StructuredMaker
from options import parse_count, parse_positive
from quarc_ref.decoder.engines import find_fast_engine

_SEEDS = Path(__file__).parents[2] / "tests" / "hostile" / "seeds" / "streams"
_DESCRIPTION = (
    "Decodes mutated streams; each must give frames or a rejection, with limited time and memory."
)
_Block = tuple[int, int]
_NUMBER_FILE_PREFIX = "at_"  # of files with the number of a process's current mutant
_process_series: list[Series] = []  # the series of this worker process, at most one


def main() -> int:
    """Judge the requested mutants and print the results; return the exit status."""
    arguments = _parse_arguments()
    if not _read_seeds(arguments.seeds):
        sys.exit(f"{arguments.seeds} contains no streams (*.quarc) to mutate")
    if find_fast_engine() is None:  # one of the modes uses both engines
        sys.exit("hostile.py needs the fast engine, which is not installed: see core/README.md")
    if arguments.only is not None:
        return _judge_one(arguments)
    folder: Path = arguments.out / _name_series(arguments)
    (folder / "failures").mkdir(parents=True, exist_ok=True)
    saved_blocks = read_blocks(folder / "blocks.jsonl")
    blocks = _list_blocks(arguments.streams)
    missing_blocks = [block for block in blocks if block not in saved_blocks]
    if missing_blocks:
        _judge_blocks(missing_blocks, folder, arguments)
        saved_blocks = read_blocks(folder / "blocks.jsonl")
    tally = Tally()
    for block in blocks:
        tally.add(saved_blocks[block])
    report = tally.as_json()
    report["unreached"] = tally.list_missing_reject_ids() if arguments.structured else []
    print(json.dumps(report, indent=2) if arguments.json else _format_report(report))
    has_failed = tally.failures or tally.peak_rss_mib > judge.MAX_MEBIBYTES or report["unreached"]
    return 1 if has_failed else 0


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=_DESCRIPTION)
    add = parser.add_argument
    add("--streams", type=parse_positive, default=10_000, metavar="N", help="number of mutants")
    add(
        "--processes",
        type=parse_positive,
        default=1,
        metavar="P",
        help="number of worker processes",
    )
    add(
        "--structured",
        action="store_true",
        help="judge streams with hostile values and correct CRCs, decoded by both engines",
    )
    add(
        "--both-engines",
        action="store_true",
        help="decode every mutant with both engines, and compare their frames and rejections",
    )
    add("--series", type=parse_count, default=0, metavar="S", help="seed of the series of mutants")
    add("--seeds", type=Path, default=_SEEDS, metavar="DIR", help="valid streams to mutate")
    add(
        "--out",
        type=Path,
        default=Path("out/hostile"),
        metavar="DIR",
        help="folder for results; a run continues with the results that are already there",
    )
    add(
        "--only",
        type=parse_count,
        metavar="N",
        help="judge only mutant N and print the result",
    )
    add("--json", action="store_true", help="print JSON")
    return parser.parse_args()


def _name_series(arguments: argparse.Namespace) -> str:
    """Return the name of the folder of a series; mutants also depend on the seeds."""
    if arguments.structured:
        return f"structured_{arguments.series}"
    kind, digest = "both_engines" if arguments.both_engines else "series", hashlib.sha256()
    for name, data in _read_seeds(arguments.seeds).items():
        digest.update(f"{name} {len(data)} ".encode() + data)
    return f"{kind}_{arguments.series}_{digest.hexdigest()[:8]}"


def _list_blocks(streams: int) -> list[_Block]:
    """Return the number of the first stream, and the number of streams, of each block."""
    return [(first, min(BLOCK_SIZE, streams - first)) for first in range(0, streams, BLOCK_SIZE)]


def _judge_blocks(blocks: list[_Block], folder: Path, arguments: argparse.Namespace) -> None:
    failures = folder / "failures"
    for path in failures.glob(_NUMBER_FILE_PREFIX + "*"):  # left by an interrupted run
        path.unlink()
    with ProcessPoolExecutor(
        arguments.processes, initializer=_prepare_process, initargs=(arguments,)
    ) as pool:
        pending = {pool.submit(_judge_block, block, failures): block for block in blocks}
        try:
            for done_count, future in enumerate(as_completed(pending), 1):
                tally = _get_tally(future, failures)
                append_block(folder / "blocks.jsonl", *pending[future], tally)
                if not arguments.json:
                    sys.stderr.write(f"\r{done_count}/{len(blocks)} blocks of {BLOCK_SIZE}")
        except BaseException:
            # The pool would otherwise judge all other blocks first, and lose their results.
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _get_tally(future: "Future[Tally]", failures: Path) -> Tally:
    """Return the tally of a block; exit with a message if a mutant has killed a process."""
    try:
        return future.result()
    except BrokenProcessPool:
        numbers = sorted(path.read_text() for path in failures.glob(_NUMBER_FILE_PREFIX + "*"))
        sys.exit(
            f"a process died while judging one of the mutants {', '.join(numbers)}; "
            "judge each of them with --only to find out which"
        )


def _prepare_process(arguments: argparse.Namespace) -> None:
    streams = _read_seeds(arguments.seeds)
    maker = (
        StructuredMaker(arguments.series)
        if arguments.structured
        else Mutator(streams, arguments.series)
    )
    series = Series(maker)
    if arguments.structured or arguments.both_engines:
        series = Series(maker, lambda _number: judge.BOTH_ENGINES_MODE)
    _process_series.append(series)
    judge.prepare(streams.values())


def _judge_block(block: _Block, failures: Path) -> Tally:
    """Judge a block; keep the number of the current mutant in a file, in case the process dies."""
    number_path = failures / f"{_NUMBER_FILE_PREFIX}{os.getpid()}"
    with number_path.open("wb", buffering=0) as file:
        tally = judge_block(
            _process_series[-1],
            *block,
            failures,
            lambda number: os.pwrite(file.fileno(), b"%9d" % number, 0),
        )
    number_path.unlink()
    return tally


def _judge_one(arguments: argparse.Namespace) -> int:
    _prepare_process(arguments)
    mutant, mode = (
        _process_series[-1].maker.make(arguments.only),
        _process_series[-1].choose_mode(arguments.only),
    )
    verdict = judge.judge(mode, mutant.data, has_forged_crcs=mutant.has_forged_crcs)
    print(verdict.outcome, f"{verdict.seconds:.3f} s", mode, mutant, verdict.detail)
    return int(verdict.is_failure)


def _read_seeds(folder: Path) -> dict[str, bytes]:
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.quarc"))}


def _format_report(report: dict[str, Any]) -> str:
    lines = [f"{name}: {value}" for name, value in report.items() if name != "rejections"]
    rows = [f"| {name} | {count:,} |" for name, count in report["rejections"].items()]
    return "\n".join([*lines, "", "| reject id | streams |", "|---|---|", *rows])
