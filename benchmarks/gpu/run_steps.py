"""Runs each step in a separate process with a time limit."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gpu.plan import Step
from gpu.rows import Row, RowLog

_PROGRAM = Path(__file__).resolve().parents[1] / "gpu.py"
_MIN_STEP_SECONDS = 5.0
_MAX_MESSAGE_LENGTH = 300
_STEP_LABEL = "the step"


@dataclass(frozen=True, slots=True)
class StepEnvironment:
    """Folder and options that all steps share.

    Attributes:
        folder: Folder that all steps share for their files.
        results: Folder for the logs of failed steps.
        is_dry_run: Whether to run on the CPU with tiny sizes.
        packages: Folder of packages installed from wheels; None without `--wheels`.
    """

    folder: Path
    results: Path
    is_dry_run: bool
    packages: Path | None


def run_step(step: Step, time_limit: float, environment: StepEnvironment, rows: list[Row]) -> None:
    """Run a step; append its rows, and a row that states how the step ended.

    The output of the step is kept as a log file if the step failed, or one of its rows does not
    hold.

    Args:
        step: Step to run.
        time_limit: Time limit in seconds.
        environment: Folder and options of all steps.
        rows: List to which rows are appended, even if the run is interrupted.
    """
    log = environment.results / make_file_name(step, "log")
    log.unlink(missing_ok=True)
    row_log = RowLog(environment.folder / make_file_name(step, "jsonl"))
    start, failure = time.monotonic(), "interrupted"
    try:
        failure = (
            "no time is left"
            if time_limit < _MIN_STEP_SECONDS
            else _run_process(_make_command(step, environment), time_limit, environment, log)
        )
    finally:
        step_rows, progress = row_log.read()
        step_rows.append(_make_end_row(step, failure, progress, time.monotonic() - start))
        rows += step_rows
        if all(row.holds is not False for row in step_rows):
            log.unlink(missing_ok=True)


def make_file_name(step: Step, suffix: str) -> str:
    """Return the name of a step's file with this suffix, such as `log`."""
    return f"{step.name.replace(' ', '_')}.{suffix}"


def _make_end_row(step: Step, failure: str, progress: str, seconds: float) -> Row:
    if failure:
        progress_note = f" (at {progress})" if progress else ""
        return Row(step.name, _STEP_LABEL, f"failed: {failure}{progress_note}", "done", holds=False)
    return Row(
        step.name, _STEP_LABEL, f"done in {seconds:.0f} s", "done", True, {"seconds": seconds}
    )


def _run_process(
    command: list[str], time_limit: float, environment: StepEnvironment, log: Path
) -> str:
    """Run a command; return why it failed, or an empty string if it succeeded."""
    with log.open("wb") as output:
        process = subprocess.Popen(
            command, stdout=output, stderr=output, env=_make_environment(environment.packages),
            start_new_session=os.name == "posix",
        )  # fmt: skip
        try:
            exit_code = process.wait(time_limit)
        except subprocess.TimeoutExpired:
            return f"not finished after {time_limit:.0f} s"
        finally:
            _kill_process(process)
    return "" if exit_code == 0 else _read_last_line(log, exit_code)


def _make_command(step: Step, environment: StepEnvironment) -> list[str]:
    command = [sys.executable, str(_PROGRAM), "--step", step.name, "--out", str(environment.folder)]
    return [*command, "--dry-run"] if environment.is_dry_run else command


def _kill_process(process: "subprocess.Popen[bytes]") -> None:
    """Kill a step and all processes that it has started, such as compilers."""
    if process.poll() is None:
        if os.name == "posix":
            os.killpg(process.pid, 9)
        else:
            process.kill()
        process.wait()


def _make_environment(packages: Path | None) -> dict[str, str]:
    root = str(_PROGRAM.parents[1])
    paths = [root, *([str(packages)] if packages else []), os.environ.get("PYTHONPATH", "")]
    # Programs of packages, such as ninja, are found even if no virtual environment is activated.
    programs = [str(packages / "bin")] if packages else []
    programs += [str(Path(sys.executable).parent), os.environ.get("PATH", "")]
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "PATH": os.pathsep.join(filter(None, programs)),
    }


def _read_last_line(log: Path, exit_code: int) -> str:
    lines = log.read_text(errors="replace").strip().splitlines()
    return lines[-1][-_MAX_MESSAGE_LENGTH:] if lines else f"exit code {exit_code}"


def allot_time(steps: tuple[Step, ...], seconds: float) -> Iterator[tuple[Step, float]]:
    """Yield each step with its time limit in seconds; `seconds` is the time for all steps."""
    end = time.monotonic() + seconds
    for step in steps:
        yield step, min(step.time_limit, end - time.monotonic())
