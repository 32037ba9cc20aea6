"""Studies of many jobs, each of which saves a row: completed jobs are not run again.

A row is a JSON file with a key that identifies its inputs. An interrupted study continues with the
missing rows.
"""

import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from kept_files import write_atomically
from quarc_ref.jobs import Job, WorkerPool, run_jobs

Row = dict[str, Any]

_SECONDS_BETWEEN_LINES = 20.0
_SECONDS_BETWEEN_TABLES = 30.0


def save_row(path: Path, key: str, row: Row) -> None:
    """Write a row.

    Args:
        path: Of its file.
        key: Digest of all inputs.
        row: What was measured.
    """
    write_atomically(path, json.dumps({"key": key, **row}, indent=1).encode())


def load_row(path: Path, key: str) -> Row | None:
    """Return a row; None if there is no such file, or it has other inputs."""
    if not path.is_file():
        return None
    row: Row = json.loads(path.read_text())
    return row if row["key"] == key else None


def run_missing(
    make_row: Callable[[Any], None],
    jobs: Sequence[Job[Any]],
    pool: WorkerPool,
    write_tables: Callable[[], object],
) -> None:
    """Run the jobs whose rows are missing; tables are updated from time to time.

    Args:
        make_row: Computes a job's row and saves it.
        jobs: Jobs whose rows are missing.
        pool: Worker processes, or a Ray cluster.
        write_tables: Writes the tables of the existing rows.

    Raises:
        JobsError: Some jobs failed; all others are complete.
    """
    written = time.monotonic()

    def report_job(name: str, over: int, total: int) -> None:
        nonlocal written
        note(f"{name} is over, {over} of {total}")
        if time.monotonic() > written + _SECONDS_BETWEEN_TABLES:
            write_tables()
            written = time.monotonic()

    run_jobs(make_row, jobs, pool, report_job)


def sum_seconds(seconds: dict[str, float], frames: int) -> dict[str, float]:
    """Return the seconds of the canonical frame, and of a later frame by stage.

    Args:
        seconds: Of a `StageTimer`.
        frames: Number of frames, including the canonical one.
    """
    once = {name: seconds.get(name, 0.0) for name in ("canonical", "canonical commit")}
    later = {
        name: seconds.get(name, 0.0) / max(frames - 1, 1)
        for name in ("anchors", "motion", "placement", "births", "commit")
    }
    return {**once, **later, "frame": sum(later.values())}


def note(text: str) -> None:
    """Write a line to standard error."""
    sys.stderr.write(text + "\n")


class ProgressLines:
    """Writes the progress of a job to standard error from time to time.

    Args:
        name: Of the job.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._next = time.monotonic() + _SECONDS_BETWEEN_LINES

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        if stage in {"canonical", "frames"} and time.monotonic() >= self._next:
            self._next = time.monotonic() + _SECONDS_BETWEEN_LINES
            note(f"{self._name}: {stage} {done}/{total}")
