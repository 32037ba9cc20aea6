"""Breaks the reference decoder in one place at a time: does the suite detect it?

    python conformance/selftest/run_mutants.py             every mutant: who caught it
    python conformance/selftest/run_mutants.py --only CRC  those whose names hold a word
    python conformance/selftest/run_mutants.py --all       and who else would have

A mutant is tested until a category of vectors detects it, or with --all by every category. The
script fails if a mutant survives, if one no longer applies, or if one that a single category should
detect is not detected by exactly that category: so each category has a mutant that would survive
without it.
"""

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

_HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(_HERE), str(_HERE.parent)]

from mutants import MUTANTS, Mutant  # noqa: E402, the path is set above
from runner.case_runner import CaseRunner  # noqa: E402
from runner.cases import MODES, Case, list_cases  # noqa: E402
from runner.judge import PASS  # noqa: E402
from runner.limits import Limits  # noqa: E402
from runner.manifest import Suite  # noqa: E402

PACKAGE = _HERE.parents[1] / "quarc_ref"
CATEGORIES = ("traps", "invalid", "streams", "unit", "damaged", "levels", "resource")
_SERIES = "damaged/cut-at-byte"
_LAUNCHER = """import sys
sys.path[0] = {folder!r}
from quarc_ref.conformance.__main__ import main
sys.exit(main())
"""


@dataclass(frozen=True)
class Outcome:
    """The result of a mutant.

    Attributes:
        mutant: Which.
        caught: The first case of each category that failed, and how.
    """

    mutant: Mutant
    caught: dict[str, str]


def break_package(mutant: Mutant, package: Path, folder: Path) -> str:
    """Make a copy of a package with a mistake in it; return the command that runs it.

    Raises:
        ValueError: A text to replace does not occur exactly once.
    """
    ignored = shutil.ignore_patterns("__pycache__", "*.pyc")
    shutil.copytree(package, folder / "quarc_ref", ignore=ignored)
    for file, old, new in mutant.edits:
        path = folder / "quarc_ref" / file
        text = path.read_text("utf-8")
        if text.count(old) != 1:
            message = f"{mutant.name}: {old!r} is {text.count(old)} times in {file}"
            raise ValueError(message)
        path.write_text(text.replace(old, new), "utf-8")
    launcher = folder / "decoder.py"
    launcher.write_text(_LAUNCHER.format(folder=str(folder)), "utf-8")
    return f"{sys.executable} {launcher}"


def try_mutant(
    mutant: Mutant, package: Path, suite: Suite, limits: Limits, enough_caught: int
) -> Outcome:
    """Test a broken decoder until enough categories detect the mistake, or no cases are left."""
    enough_caught = len(CATEGORIES) if mutant.alone else enough_caught
    with tempfile.TemporaryDirectory() as folder:
        case_runner = CaseRunner(
            break_package(mutant, package, Path(folder)), suite, limits, jobs=True
        )
        try:
            caught = _find_first(list_all(suite), case_runner, enough_caught)
        finally:
            case_runner.close()
    return Outcome(mutant, caught)


def list_all(suite: Suite) -> list[Case]:
    """Return all cases, those first that detect most in the shortest time."""
    functions = [unit["function"] for unit in suite.units]
    cases = list_cases(
        suite, {"capabilities": [*MODES, "metadata", "updates", "snapshots"], "units": functions}
    )
    return sorted(cases, key=lambda case: CATEGORIES.index(case.category))


def _find_first(
    cases: Iterable[Case], case_runner: CaseRunner, enough_caught: int
) -> dict[str, str]:
    caught: dict[str, str] = {}
    for case in cases:
        if len(caught) == enough_caught:
            break
        # There are many cuts at every byte; those at chosen places detect as much.
        if case.category in caught or case.name.startswith(_SERIES):
            continue
        verdict = case_runner.run_case(case)
        if verdict.name != PASS:
            caught[case.category] = f"{case.name}: {verdict.name}"
    return caught


def describe(outcome: Outcome) -> str:
    """Return a line on which categories detected a mutant, and how."""
    lines = [outcome.mutant.name + ("" if outcome.caught else ": SURVIVES")]
    lines += [f"    {category:<9} {said}" for category, said in sorted(outcome.caught.items())]
    return "\n".join(lines)


def summarize_categories(outcomes: list[Outcome]) -> tuple[str, bool]:
    """Return which mutant needs which category, and whether all expectations hold."""
    lines, good = ["Mutants that only one category detects:"], True
    for outcome in outcomes:
        if outcome.mutant.alone:
            needed = outcome.caught.keys() == {outcome.mutant.alone}
            said = "" if needed else f" NO: caught by {', '.join(outcome.caught)}"
            lines.append(f"    {outcome.mutant.alone:<9} {outcome.mutant.name}{said}")
            good = good and needed
    caught = sum(bool(outcome.caught) for outcome in outcomes)
    lines.append(f"{caught} of {len(outcomes)} mutants caught")
    return "\n".join(lines), good and caught == len(outcomes)


def main() -> int:
    """Return 0 if every mutant was detected and every category is needed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="mutants whose names contain this")
    parser.add_argument("--all", action="store_true", help="ask every category")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--timeout", type=float, default=30.0, help="time limit of a case in seconds"
    )
    parser.add_argument("--package", type=Path, default=PACKAGE, help="what is broken")
    options = parser.parse_args()
    os.environ["QUARC_REF_ENGINE"] = "reference"  # what is broken
    suite = Suite.load(_HERE.parent)
    wanted = [mutant for mutant in MUTANTS if options.only in mutant.name]
    limits = Limits(options.timeout, 512)
    enough_caught = len(CATEGORIES) if options.all else 1
    attempt = partial(
        try_mutant, package=options.package, suite=suite, limits=limits, enough_caught=enough_caught
    )
    outcomes = []
    with ThreadPoolExecutor(options.processes) as pool:
        for outcome in pool.map(attempt, wanted):
            print(describe(outcome), flush=True)
            outcomes.append(outcome)
    text, good = summarize_categories(outcomes)
    print(text)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
