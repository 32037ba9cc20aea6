"""Runs steps one after another, each in a separate process with a time limit."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gpu.plan import Step
from gpu.rows import Notebook, Row

_PROGRAM = Path(__file__).resolve().parents[1] / "gpu.py"
_MIN_SECONDS = 5.0
_LAST_WORDS = 300
_STEP = "the step"


@dataclass(frozen=True, slots=True)
class Place:
    """Where steps work.

    Attributes:
        folder: That they share.
        dry: Whether to run on the CPU in tiny sizes.
        packages: Folder with the packages that the machine lacks; None if it has all.
    """

    folder: Path
    dry: bool
    packages: Path | None


def run_step(step: Step, limit: float, place: Place, rows: list[Row]) -> None:
    """Run a step; add its rows, and one that says how it ended.

    Args:
        step: To be run.
        limit: Seconds, at most.
        place: Where it works.
        rows: List that is extended, even if the run is interrupted.
    """
    notebook = Notebook(place.folder / name_file(step, "jsonl"))
    start_state, fault = time.monotonic(), "interrupted"
    try:
        fault = "no time is left" if limit < _MIN_SECONDS else _run(step, limit, place)
    finally:
        found, progress = notebook.read()
        rows += [*found, _close(step, fault, progress, time.monotonic() - start_state)]


def name_file(step: Step, ending: str) -> str:
    """Return the file name of a step."""
    return f"{step.name.replace(' ', '_')}.{ending}"


def _close(step: Step, fault: str, progress: str, seconds: float) -> Row:
    if fault:
        reached = f" (at {progress})" if progress else ""
        return Row(step.name, _STEP, f"failed: {fault}{reached}", "done", holds=False)
    return Row(step.name, _STEP, f"done in {seconds:.0f} s", "done", True, {"seconds": seconds})


def _run(step: Step, limit: float, place: Place) -> str:
    """Return why a step failed; empty if it succeeded."""
    command = [sys.executable, str(_PROGRAM), "--step", step.name, "--out", str(place.folder)]
    command += ["--dry-run"] if place.dry else []
    log = place.folder / name_file(step, "log")
    with log.open("wb") as output:
        child = subprocess.Popen(
            command, stdout=output, stderr=output, env=_make_environment(place.packages),
            start_new_session=os.name == "posix",
        )  # fmt: skip
        try:
            code = child.wait(limit)
        except subprocess.TimeoutExpired:
            return f"not done after {limit:.0f} s"
        finally:
            _end(child)
    return "" if code == 0 else _read_last_line(log, code)


def _end(child: "subprocess.Popen[bytes]") -> None:
    """Kill a step and all processes that it has started, such as compilers."""
    if child.poll() is None:
        if os.name == "posix":
            os.killpg(child.pid, 9)
        else:
            child.kill()
        child.wait()


def _make_environment(packages: Path | None) -> dict[str, str]:
    root = str(_PROGRAM.parents[1])
    paths = [root, *([str(packages)] if packages else []), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    if packages:  # programs in these packages, such as ninja
        environment["PATH"] = os.pathsep.join([str(packages / "bin"), os.environ.get("PATH", "")])
    return environment


def _read_last_line(log: Path, code: int) -> str:
    lines = log.read_text(errors="replace").strip().splitlines()
    return lines[-1][-_LAST_WORDS:] if lines else f"exit code {code}"


def allot_time(steps: tuple[Step, ...], seconds: float) -> Iterator[tuple[Step, float]]:
    """Yield the steps with their time limits."""
    end = time.monotonic() + seconds
    for step in steps:
        yield step, min(step.seconds, end - time.monotonic())
