"""The command line of benchmarks/gpu.py."""

import argparse
import signal
import sys
import tempfile
from pathlib import Path

from gpu.plan import DRY, REAL, STEPS
from gpu.rows import Notebook, Row, format_table, write_tables
from gpu.run_steps import Place, allot_time, name_file, run_step
from gpu.wheels import fetch, install_missing, name_packages

_MINUTES = 9.5
_INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 if all steps ran and all checks passed, 1 otherwise, 130 after an interruption.
    """
    parser = argparse.ArgumentParser(
        description=__import__("gpu").__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="for gpu.md and gpu.json")
    parser.add_argument("--dry-run", action="store_true", help="on the CPU, in tiny sizes")
    parser.add_argument("--minutes", type=float, default=_MINUTES, help="for all steps together")
    parser.add_argument("--wheels", type=Path, metavar="DIR", help="install missing packages")
    parser.add_argument("--fetch", type=Path, metavar="DIR", help="only download wheels")
    parser.add_argument("--python", default=".".join(map(str, sys.version_info[:2])))
    parser.add_argument("--step", choices=[step.name for step in STEPS], help=argparse.SUPPRESS)
    asked = parser.parse_args(arguments)
    if asked.fetch:
        return fetch(asked.fetch, asked.python)
    if not asked.out:
        parser.error("--out DIR or --fetch DIR is needed")
    if asked.step:
        return _work(asked.step, asked.out, dry=asked.dry_run)
    return _run_all(asked)


def _work(name: str, folder: Path, *, dry: bool) -> int:
    """Run one step in this process."""
    (step,) = (step for step in STEPS if step.name == name)
    step.load()(DRY if dry else REAL, folder, Notebook(folder / name_file(step, "jsonl")))
    return 0


def _run_all(asked: argparse.Namespace) -> int:
    """Run all steps and write the tables after each."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    asked.out.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    code = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            packages = _install_packages(asked.wheels, rows)
            place = Place(folder, asked.dry_run, packages)
            for step, limit in allot_time(STEPS, 60 * asked.minutes):
                run_step(step, limit, place, rows)
                write_tables(rows, asked.out)
                if step.is_required and not rows[-1].holds:
                    break
        except KeyboardInterrupt:
            code = _INTERRUPTED
        write_tables(rows, asked.out)
    sys.stdout.write(format_table(rows))
    return code or int(any(row.holds is False for row in rows))


def _install_packages(wheels: Path | None, rows: list[Row]) -> Path | None:
    """Return the folder of packages installed from wheels; None if there is none."""
    if wheels is None:
        return None
    try:
        rows.append(Row("wheels", "packages", install_missing(wheels)))
    except RuntimeError as error:
        rows.append(Row("wheels", "packages", f"failed: {error}", "done", holds=False))
    return name_packages(wheels)
