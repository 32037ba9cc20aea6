"""The command line of benchmarks/hostile.py."""

import argparse
import json
import os
import sys
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

# Set before NumPy is loaded, because the threads it would start count as memory here.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hostile import judge
from hostile.blocks import BLOCK, Series, Tally, append_block, judge_block, read_blocks
from hostile.mutations import Mutator
from hostile.structured.maker import StructuredMaker

_SEEDS = Path(__file__).parents[2] / "tests" / "hostile" / "seeds" / "streams"
_WHAT = "Decodes mutated streams: any bytes must give frames or a rejection, within limits."
_Block = tuple[int, int]
_AT = "at_"  # prefix of files with the number of the current mutant of a process
_series: list[Series] = []  # the series of this process


def main() -> int:
    """Judge the requested mutants and print the results."""
    arguments = _parse_arguments()
    if arguments.only is not None:
        return _judge_one(arguments)
    kind = "structured" if arguments.structured else "series"
    folder: Path = arguments.out / f"{kind}_{arguments.series}"
    (folder / "failures").mkdir(parents=True, exist_ok=True)
    kept = read_blocks(folder / "blocks.jsonl")
    wanted = _list_blocks(arguments.streams)
    missing = [block for block in wanted if block not in kept]
    if missing:
        _judge_blocks(missing, folder, arguments)
        kept = read_blocks(folder / "blocks.jsonl")
    tally = Tally()
    for block in wanted:
        tally.add(kept[block])
    reported = tally.as_json()
    reported["unreached"] = tally.list_missing_reject_ids() if arguments.structured else []
    print(json.dumps(reported, indent=2) if arguments.json else _as_text(reported))
    failed = tally.failures or tally.peak_rss_mib > judge.MEBIBYTES or reported["unreached"]
    return 1 if failed else 0


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=_WHAT)
    add = parser.add_argument
    add("--streams", type=int, default=10_000, metavar="N", help="how many mutants")
    add("--processes", type=int, default=1, metavar="P", help="at once")
    add(
        *("--structured",),
        action="store_true",
        help="streams with hostile values and correct CRCs, decoded by both engines",
    )
    add("--series", type=int, default=0, metavar="S", help="which mutants")
    add("--seeds", type=Path, default=_SEEDS, metavar="DIR", help="valid streams to mutate")
    add("--out", type=Path, default=Path("out/hostile"), metavar="DIR", help="kept between runs")
    add(
        "--only",
        type=int,
        metavar="N",
        help="judge one mutant and print the result to standard error",
    )
    add("--json", action="store_true", help="print JSON")
    return parser.parse_args()


def _list_blocks(streams: int) -> list[_Block]:
    """Return the first number and the count of every block."""
    return [(first, min(BLOCK, streams - first)) for first in range(0, streams, BLOCK)]


def _judge_blocks(blocks: list[_Block], folder: Path, arguments: argparse.Namespace) -> None:
    failures = folder / "failures"
    with ProcessPoolExecutor(
        arguments.processes, initializer=_begin, initargs=(arguments,)
    ) as pool:
        pending = {pool.submit(_judge_block, block, failures): block for block in blocks}
        for done, future in enumerate(as_completed(pending), 1):
            append_block(folder / "blocks.jsonl", *pending[future], _wait(future, failures))
            if not arguments.json:
                sys.stderr.write(f"\r{done}/{len(blocks)} blocks of {BLOCK}")


def _wait(future: "Future[Tally]", failures: Path) -> Tally:
    """Return the results of a block; stop everything if a mutant has killed a process."""
    try:
        return future.result()
    except BrokenProcessPool:
        numbers = sorted(path.read_text() for path in failures.glob(_AT + "*"))
        sys.exit(f"a process died while it judged one of {', '.join(numbers)}: see --only")


def _begin(arguments: argparse.Namespace) -> None:
    streams = _read_seeds(arguments.seeds)
    if arguments.structured:
        maker = StructuredMaker(arguments.series)
        _series.append(Series(maker, lambda _number: judge.BY_BOTH_ENGINES))
    else:
        _series.append(Series(Mutator(streams, arguments.series)))
    judge.prepare(streams.values())


def _judge_block(block: _Block, failures: Path) -> Tally:
    """Judge a block; a file names the current mutant in case it kills the process."""
    place = failures / f"{_AT}{os.getpid()}"
    with place.open("wb", buffering=0) as file:
        tally = judge_block(
            _series[-1],
            *block,
            failures,
            lambda number: os.pwrite(file.fileno(), b"%9d" % number, 0),
        )
    place.unlink()
    return tally


def _judge_one(arguments: argparse.Namespace) -> int:
    _begin(arguments)
    mutant, way = _series[-1].maker.make(arguments.only), _series[-1].choose_mode(arguments.only)
    verdict = judge.judge(way, mutant.data, forged=mutant.forged)
    print(verdict.outcome, f"{verdict.seconds:.3f} s", way, mutant, verdict.detail)
    return int(verdict.is_failure)


def _read_seeds(folder: Path) -> dict[str, bytes]:
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.quarc"))}


def _as_text(reported: dict[str, Any]) -> str:
    lines = [f"{name}: {value}" for name, value in reported.items() if name != "rejections"]
    rows = [f"| {name} | {count:,} |" for name, count in reported["rejections"].items()]
    return "\n".join([*lines, "", "| reject id | streams |", "|---|---|", *rows])
