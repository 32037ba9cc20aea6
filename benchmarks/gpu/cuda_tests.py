"""The tests that need a CUDA device."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

from gpu.plan import Sizes
from gpu.rows import Notebook, Row

_ROOT = Path(__file__).resolve().parents[2]
_MARK = re.compile(r"pytest\.mark\.gpu\b")


def list_files() -> list[Path]:
    """Return the files that contain such tests; no other file is imported."""
    tests = sorted((_ROOT / "tests").rglob("test_*.py"))
    return [path for path in tests if _MARK.search(path.read_text())]


def work(sizes: Sizes, folder: Path, notebook: Notebook) -> None:
    """Run the tests with pytest and count them."""
    report = folder / "tests.xml"
    command = [sys.executable, "-m", "pytest", "-q", "-m", "gpu", "-p", "no:cacheprovider"]
    command += ["-W", "default"]  # warnings of compilers about code of others
    command += [f"--junitxml={report}", *map(str, list_files())]
    done = subprocess.run(command, cwd=_ROOT, check=False, capture_output=True, text=True)
    if not report.exists():
        message = f"pytest ended with {done.returncode}: {done.stdout[-300:]} {done.stderr[-300:]}"
        raise RuntimeError(message)
    notebook.add(count_tests(report, most_skipped=None if sizes.device == "cpu" else 0))


def count_tests(report: Path, most_skipped: int | None) -> Row:
    """Return the row for a pytest report.

    Args:
        report: JUnit XML.
        most_skipped: Maximum number of skipped tests; None for no limit.
    """
    suite = ElementTree.parse(report).getroot().find("testsuite")
    if suite is None:
        message = f"{report} has no test suite"
        raise RuntimeError(message)
    counts = {name: int(suite.get(name, "0")) for name in ("tests", "skipped")}
    counts["failed"] = int(suite.get("failures", "0")) + int(suite.get("errors", "0"))
    counts["passed"] = counts["tests"] - counts["skipped"] - counts["failed"]
    named = [case.get("name", "") for case in suite.iter("testcase") if _has_failed(case)]
    too_many = most_skipped is not None and counts["skipped"] > most_skipped
    said = f"{counts['passed']} passed, {counts['skipped']} skipped, {counts['failed']} failed"
    return Row(
        "tests",
        "tests that need CUDA",
        "; ".join([said, *named]),
        "all pass" if most_skipped == 0 else "none fails",
        not counts["failed"] and not too_many and counts["tests"] > 0,
        {name: float(count) for name, count in counts.items()},
    )


def _has_failed(case: ElementTree.Element) -> bool:
    return case.find("failure") is not None or case.find("error") is not None
