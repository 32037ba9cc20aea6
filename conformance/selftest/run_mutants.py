"""Checks that the suite detects mutants: copies of the reference decoder with one mistake each.

    python conformance/selftest/run_mutants.py             test each mutant until it is detected
    python conformance/selftest/run_mutants.py --only CRC  test mutants with CRC in their name
    python conformance/selftest/run_mutants.py --all       test each mutant with every category

The script fails if a mutant survives or is broken, or if the text that it replaces is not in the
source. A mutant is broken if it crashes on a plain valid stream: it then shows nothing about the
vectors. The script also fails if a mutant with an `only_category` is not detected by exactly this
category. Every category has such a mutant, which shows that the category is needed.
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
_CUTS_AT_EVERY_BYTE = "damaged/cut-at-byte"
_PLAIN_STREAM = "streams/still"
_CRASHES = ("crash", "silent", "garbage")
_LAUNCHER = """import sys
sys.path[0] = {folder!r}
from quarc_ref.conformance.__main__ import main
sys.exit(main())
"""


@dataclass(frozen=True)
class Outcome:
    """The result of testing a mutant.

    Attributes:
        mutant: The tested mutant.
        first_failures: The first failed case of each category, with its verdict.
        crash: How the mutant crashes on a plain valid stream; empty if it does not.
    """

    mutant: Mutant
    first_failures: dict[str, str]
    crash: str = ""


def copy_with_mutant(mutant: Mutant, package: Path, folder: Path) -> str:
    """Copy a package, apply a mutant to the copy, and return the command that runs it.

    Raises:
        ValueError: A text to replace does not occur exactly once in its file.
    """
    ignored = shutil.ignore_patterns("__pycache__", "*.pyc")
    shutil.copytree(package, folder / "quarc_ref", ignore=ignored)
    for file, old, new in mutant.edits:
        path = folder / "quarc_ref" / file
        text = path.read_text("utf-8")
        if text.count(old) != 1:
            message = (
                f"{mutant.name}: {old!r} occurs {text.count(old)} times in {file}, expected once"
            )
            raise ValueError(message)
        path.write_text(text.replace(old, new), "utf-8")
    launcher = folder / "decoder.py"
    launcher.write_text(_LAUNCHER.format(folder=str(folder)), "utf-8")
    return f"{sys.executable} {launcher}"


def try_mutant(
    mutant: Mutant, package: Path, suite: Suite, limits: Limits, needed_categories: int
) -> Outcome:
    """Test a mutant until `needed_categories` categories detect it, or no case is left.

    A mutant that crashes on a plain valid stream is not tested further.
    """
    needed_categories = len(CATEGORIES) if mutant.only_category else needed_categories
    cases = list_all_cases(suite)
    with tempfile.TemporaryDirectory() as folder:
        case_runner = CaseRunner(
            copy_with_mutant(mutant, package, Path(folder)), suite, limits, supports_jobs=True
        )
        try:
            plain_case = next(case for case in cases if case.name == _PLAIN_STREAM)
            verdict = case_runner.run_case(plain_case)
            if verdict.name in _CRASHES:
                return Outcome(mutant, {}, f"{_PLAIN_STREAM}: {verdict.name}: {verdict.message}")
            first_failures = _find_first_failures(cases, case_runner, needed_categories)
        finally:
            case_runner.close()
    return Outcome(mutant, first_failures)


def list_all_cases(suite: Suite) -> list[Case]:
    """Return all cases, beginning with the categories that detect the most mutants per second."""
    functions = [unit["function"] for unit in suite.units]
    cases = list_cases(
        suite, {"capabilities": [*MODES, "metadata", "updates", "snapshots"], "units": functions}
    )
    return sorted(cases, key=lambda case: CATEGORIES.index(case.category))


def _find_first_failures(
    cases: Iterable[Case], case_runner: CaseRunner, needed_categories: int
) -> dict[str, str]:
    first_failures: dict[str, str] = {}
    for case in cases:
        if len(first_failures) == needed_categories:
            break
        # The cuts at every byte detect no mutants that the other cuts do not detect.
        if case.category in first_failures or case.name.startswith(_CUTS_AT_EVERY_BYTE):
            continue
        verdict = case_runner.run_case(case)
        if verdict.name != PASS:
            first_failures[case.category] = f"{case.name}: {verdict.name}"
    return first_failures


def describe_outcome(outcome: Outcome) -> str:
    """Return text that lists the categories that detected a mutant, each with a failed case."""
    if outcome.crash:
        return f"{outcome.mutant.name}: BROKEN, {outcome.crash}"
    lines = [outcome.mutant.name + ("" if outcome.first_failures else ": SURVIVES")]
    lines += [
        f"    {category:<9} {failure}"
        for category, failure in sorted(outcome.first_failures.items())
    ]
    return "\n".join(lines)


def summarize_categories(outcomes: list[Outcome]) -> tuple[str, bool]:
    """Return a summary, and whether all mutants were detected by the expected categories."""
    lines, is_as_expected = ["Mutants that exactly one category must detect:"], True
    for outcome in outcomes:
        if outcome.mutant.only_category:
            is_needed = outcome.first_failures.keys() == {outcome.mutant.only_category}
            suffix = (
                "" if is_needed else f" FAILED: detected by {', '.join(outcome.first_failures)}"
            )
            lines.append(f"    {outcome.mutant.only_category:<9} {outcome.mutant.name}{suffix}")
            is_as_expected = is_as_expected and is_needed
    detected_count = sum(bool(outcome.first_failures) for outcome in outcomes)
    broken_count = sum(bool(outcome.crash) for outcome in outcomes)
    lines.append(
        f"{detected_count} of {len(outcomes)} mutants detected"
        + (f", {broken_count} broken" if broken_count else "")
    )
    return "\n".join(lines), is_as_expected and detected_count == len(outcomes)


def main() -> int:
    """Return 0 if all mutants were detected by the expected categories, 1 if not, 2 if none ran."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="test only mutants whose names contain this")
    parser.add_argument("--all", action="store_true", help="test each mutant with every category")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--timeout", type=float, default=30.0, help="time limit of a case in seconds"
    )
    parser.add_argument("--package", type=Path, default=PACKAGE, help="package to copy and change")
    options = parser.parse_args()
    mutants = [mutant for mutant in MUTANTS if options.only in mutant.name]
    if not mutants:
        parser.error(f"--only {options.only}: no name of a mutant contains this")
    os.environ["QUARC_REF_ENGINE"] = "reference"  # mutants change only this engine
    suite = Suite.load(_HERE.parent)
    limits = Limits(options.timeout, 512)
    needed_categories = len(CATEGORIES) if options.all else 1
    try_next_mutant = partial(
        try_mutant,
        package=options.package,
        suite=suite,
        limits=limits,
        needed_categories=needed_categories,
    )
    outcomes = []
    with ThreadPoolExecutor(options.processes) as pool:
        for outcome in pool.map(try_next_mutant, mutants):
            print(describe_outcome(outcome), flush=True)
            outcomes.append(outcome)
    summary, is_as_expected = summarize_categories(outcomes)
    print(summary)
    return 0 if is_as_expected else 1


if __name__ == "__main__":
    sys.exit(main())
