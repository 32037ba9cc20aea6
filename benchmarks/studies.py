"""Runs studies: many jobs, each of which saves a row; completed jobs are not repeated.

A row is a JSON file that contains results, and a key that identifies their inputs. If a study was
interrupted, running it again makes only the missing rows.
"""

import hashlib
import json
import sys
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from atomic_files import write_atomically
from quarc_ref.jobs import Job, JobsError, WorkerPool, run_jobs

Row = dict[str, Any]
INTERRUPTED = 130  # exit status after Ctrl-C

_LINE_INTERVAL_SECONDS = 20.0
_TABLE_INTERVAL_SECONDS = 30.0


@cache
def digest_file(path: Path) -> str:
    """Return the SHA-256 of a file, which identifies it in keys of rows."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def save_row(path: Path, key: str, row: Row) -> None:
    """Write a row to its file.

    Args:
        path: Path of the file.
        key: Digest of all inputs of the job.
        row: Results of the job.
    """
    write_atomically(path, json.dumps({"key": key, **row}, indent=1).encode())


def load_row(path: Path, key: str) -> Row | None:
    """Return the row in a file; None if the file is missing or contains another key."""
    if not path.is_file():
        return None
    row: Row = json.loads(path.read_text())
    return row if row["key"] == key else None


def run_missing(
    make_row: Callable[[Any], None],
    jobs: Sequence[Job[Any]],
    pool: WorkerPool,
    write_tables: Callable[[], object],
) -> int:
    """Run jobs in a worker pool, and rewrite the tables at most every 30 seconds, and at the end.

    Args:
        make_row: Function that computes and saves the row of a job.
        jobs: Jobs whose rows are missing.
        pool: Worker processes or Ray cluster that runs the jobs.
        write_tables: Function that writes the tables of all rows that exist.

    Returns:
        0 on success, 3 if some jobs failed (all others are complete), `INTERRUPTED` after Ctrl-C.
    """
    last_write_time = time.monotonic()

    def report_job(name: str, done_count: int, total: int) -> None:
        nonlocal last_write_time
        write_status(f"finished {name}: {done_count} of {total} jobs")
        if time.monotonic() > last_write_time + _TABLE_INTERVAL_SECONDS:
            write_tables()
            last_write_time = time.monotonic()

    try:
        run_jobs(make_row, jobs, pool, report_job)
    except JobsError as error:
        write_status(str(error))
        return 3
    except KeyboardInterrupt:
        write_status("interrupted: run the same command again to compute the missing rows")
        return INTERRUPTED
    finally:
        write_tables()
    return 0


def average_stage_seconds(seconds: dict[str, float], frames: int) -> dict[str, float]:
    """Return the seconds of the canonical frame, and the mean of each stage per later frame.

    Args:
        seconds: Total seconds by stage, from a `StageTimer`.
        frames: Number of frames, including the canonical one.
    """
    canonical_seconds = {name: seconds.get(name, 0.0) for name in ("canonical", "canonical commit")}
    frame_seconds = {
        name: seconds.get(name, 0.0) / max(frames - 1, 1)
        for name in ("anchors", "motion", "placement", "births", "commit")
    }
    return {**canonical_seconds, **frame_seconds, "frame": sum(frame_seconds.values())}


def write_status(text: str) -> None:
    """Write a line to standard error."""
    sys.stderr.write(text + "\n")


class ProgressLines:
    """Writes the progress of a job to standard error, at most every 20 seconds.

    Args:
        name: Name of the job.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._next_line_time = time.monotonic() + _LINE_INTERVAL_SECONDS

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        if stage in {"canonical", "frames"} and time.monotonic() >= self._next_line_time:
            self._next_line_time = time.monotonic() + _LINE_INTERVAL_SECONDS
            write_status(f"{self._name}: {stage} {done}/{total}")
