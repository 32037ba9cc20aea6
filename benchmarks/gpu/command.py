"""The command line of benchmarks/gpu.py."""

import argparse
import signal
import sys
import tempfile
import time
from pathlib import Path

from gpu.plan import DRY_RUN_SIZES, REAL_SIZES, STEPS
from gpu.rows import Row, RowLog, format_table, write_tables
from gpu.run_steps import StepEnvironment, allot_time, make_file_name, run_step
from gpu.wheels import fetch_wheels, install_missing, locate_packages

_DESCRIPTION = (
    "Run all tests and measurements that need a CUDA GPU; or, with --fetch, download the packages "
    "that the GPU machine may lack."
)
_DEFAULT_MINUTES = 9.5
_EXIT_INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 if all checks passed, 1 if a check failed, 130 after an interruption.
    """
    parser = argparse.ArgumentParser(description=_DESCRIPTION)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for gpu.md and gpu.json")
    parser.add_argument("--dry-run", action="store_true", help="run on the CPU with tiny sizes")
    parser.add_argument(
        "--minutes",
        type=float,
        default=_DEFAULT_MINUTES,
        help="time limit for packages and all steps together, in minutes; default: %(default)s",
    )
    parser.add_argument(
        "--wheels",
        type=Path,
        metavar="DIR",
        help="install the missing packages from the wheels in this folder",
    )
    parser.add_argument(
        "--fetch", type=Path, metavar="DIR", help="download wheels into this folder and exit"
    )
    parser.add_argument(
        "--python",
        default=".".join(map(str, sys.version_info[:2])),
        metavar="VERSION",
        help="with --fetch: Python version of the GPU machine; default: %(default)s",
    )
    parser.add_argument("--step", choices=[step.name for step in STEPS], help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.fetch:
        return fetch_wheels(options.fetch, options.python)
    if not options.out:
        parser.error("--out DIR or --fetch DIR is required")
    if options.step:
        return _run_one_step(options.step, options.out, is_dry_run=options.dry_run)
    return _run_all(options)


def _run_one_step(name: str, folder: Path, *, is_dry_run: bool) -> int:
    """Run one step in this process."""
    (step,) = (step for step in STEPS if step.name == name)
    step.import_function()(
        DRY_RUN_SIZES if is_dry_run else REAL_SIZES,
        folder,
        RowLog(folder / make_file_name(step, "jsonl")),
    )
    return 0


def _run_all(options: argparse.Namespace) -> int:
    """Run all steps; write the tables after each step, and return the exit status."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    options.out.mkdir(parents=True, exist_ok=True)
    end = time.monotonic() + 60 * options.minutes
    rows: list[Row] = []
    exit_code = 0
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        try:
            packages = _install_packages(options.wheels, rows)
            environment = StepEnvironment(folder, options.out, options.dry_run, packages)
            for step, time_limit in allot_time(STEPS, end - time.monotonic()):
                run_step(step, time_limit, environment, rows)
                write_tables(rows, options.out)
                if step.is_required and not rows[-1].holds:
                    break
        except KeyboardInterrupt:
            exit_code = _EXIT_INTERRUPTED
        write_tables(rows, options.out)
    sys.stdout.write(format_table(rows))
    return exit_code or int(any(row.holds is False for row in rows))


def _install_packages(wheels: Path | None, rows: list[Row]) -> Path | None:
    """Install missing packages from wheels; return their folder, or None without `--wheels`."""
    if wheels is None:
        return None
    try:
        rows.append(Row("wheels", "packages", install_missing(wheels)))
    except RuntimeError as error:
        rows.append(Row("wheels", "packages", f"failed: {error}", "done", holds=False))
    return locate_packages(wheels)
