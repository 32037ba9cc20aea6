"""What the command writes: files beside their targets first, JSON, tables, progress."""

import json
import os
import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from quarc_ref.cli.faults import UsageError

_SECONDS_BETWEEN_LINES = 5.0


@contextmanager
def written_file(target: Path, *, force: bool) -> Iterator[BinaryIO]:
    """Open a file beside a target, and put it in the target's place when all is written.

    Raises:
        UsageError: The target exists, and `force` is not given.
    """
    _refuse_existing(target, force=force)
    beside = _beside(target)
    try:
        with beside.open("wb") as sink:
            yield sink
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def written_folder(target: Path, *, force: bool) -> Iterator[Path]:
    """Make a folder beside a target, and put it in the target's place when all is written.

    Raises:
        UsageError: The target exists, and `force` is not given.
    """
    _refuse_existing(target, force=force)
    beside = _beside(target)
    beside.mkdir()
    try:
        yield beside
        if target.exists():
            shutil.rmtree(target)
        beside.rename(target)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def print_json(values: dict[str, object]) -> None:
    """Print values as JSON on standard output."""
    sys.stdout.write(json.dumps(values, indent=2) + "\n")


def print_table(title: str, rows: dict[str, str]) -> None:
    """Print names and values on standard output."""
    table = Table(title=title, title_justify="left", show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim")
    table.add_column()
    for name, value in rows.items():
        table.add_row(name, value)
    Console().print(table)


class TerminalProgress:
    """Shows progress on stderr: bars on a terminal, a line now and then elsewhere.

    Use as a context. Stages that come again in every frame are shown within
    the bar of the frames.

    Args:
        quiet: Whether to show nothing.
    """

    _ONCE = ("synth", "canonical", "frames", "evaluate", "decode")

    def __init__(self, *, quiet: bool) -> None:
        console = Console(stderr=True)
        self._bars = Progress(
            TextColumn("{task.description:>10}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=quiet or not console.is_terminal,
        )
        self._lines = not quiet and not console.is_terminal
        self._tasks: dict[str, TaskID] = {}
        self._next_line = 0.0

    def __enter__(self) -> "TerminalProgress":
        self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bars.stop()

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `encoder.progress.Progress`."""
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=total)
        self._bars.update(self._tasks[stage], completed=done, total=total)
        if self._lines and stage in self._ONCE:
            self._print_line(stage, done, total)

    def _print_line(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        if done == total or now >= self._next_line:
            self._next_line = now + _SECONDS_BETWEEN_LINES
            sys.stderr.write(f"{stage} {done}/{total}\n")


def _refuse_existing(target: Path, *, force: bool) -> None:
    if not target.absolute().parent.is_dir():
        message = f"{target.absolute().parent} is no folder"
        raise UsageError(message)
    if target.exists() and not force:
        message = f"{target} exists; --force replaces it"
        raise UsageError(message)


def _beside(target: Path) -> Path:
    return target.with_name(f".{target.name}.{os.getpid()}.part")
