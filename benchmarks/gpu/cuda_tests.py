"""Runs the tests that need a CUDA device."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

from gpu.plan import Sizes
from gpu.rows import Row, RowLog

_ROOT = Path(__file__).resolve().parents[2]
_GPU_MARK = re.compile(r"pytest\.mark\.gpu\b")


def list_test_files() -> list[Path]:
    """Return the files with tests that need a CUDA device."""
    tests = sorted((_ROOT / "tests").rglob("test_*.py"))
    return [path for path in tests if _GPU_MARK.search(path.read_text())]


def run(sizes: Sizes, folder: Path, row_log: RowLog) -> None:
    """Run the tests with pytest, and add a row that counts passed, skipped and failed tests."""
    report = folder / "tests.xml"
    command = [sys.executable, "-m", "pytest", "-q", "-m", "gpu", "-p", "no:cacheprovider"]
    command += ["-W", "default"]  # compilers warn about code of dependencies
    command += [f"--junitxml={report}", *map(str, list_test_files())]
    process = subprocess.run(command, cwd=_ROOT, check=False)
    if not report.exists():
        message = f"pytest exited with code {process.returncode} and wrote no report"
        raise RuntimeError(message)
    row_log.add(summarize_report(report, max_skipped=None if sizes.device == "cpu" else 0))


def summarize_report(report: Path, max_skipped: int | None) -> Row:
    """Return a row that summarizes a pytest report.

    Args:
        report: Path of the JUnit XML file.
        max_skipped: Maximum number of skipped tests; None for no limit.
    """
    suite = ElementTree.parse(report).getroot().find("testsuite")
    if suite is None:
        message = f"{report} has no `testsuite` element"
        raise RuntimeError(message)
    counts = {name: int(suite.get(name, "0")) for name in ("tests", "skipped")}
    counts["failed"] = int(suite.get("failures", "0")) + int(suite.get("errors", "0"))
    counts["passed"] = counts["tests"] - counts["skipped"] - counts["failed"]
    failed_names = [case.get("name", "") for case in suite.iter("testcase") if _has_failed(case)]
    has_too_many_skipped = max_skipped is not None and counts["skipped"] > max_skipped
    summary = f"{counts['passed']} passed, {counts['skipped']} skipped, {counts['failed']} failed"
    return Row(
        "tests",
        "tests that need CUDA",
        "; ".join([summary, *failed_names]),
        "all pass" if max_skipped == 0 else "none fails",
        not counts["failed"] and not has_too_many_skipped and counts["tests"] > 0,
        {name: float(count) for name, count in counts.items()},
    )


def _has_failed(case: ElementTree.Element) -> bool:
    return case.find("failure") is not None or case.find("error") is not None
