"""Output of commands: JSON and tables on standard output, progress on standard error."""

import json
import logging
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from types import TracebackType
from typing import Literal, NoReturn

from rich.cells import cell_len
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

_SECONDS_BETWEEN_LINES = 5.0
_REFERENCE_ENGINE_MESSAGE = (
    "scenes of this size decode many times faster with it (see core/README.md)"
)
_UNLIMITED_WIDTH = 1 << 12
_MIN_VALUE_WIDTH = 16


class _PlainConsole(Console):
    """Console that prints text without markup, because streams may contain any text."""

    def __init__(self, width: int | None = None) -> None:
        super().__init__(markup=False, emoji=False, width=width)

    def on_broken_pipe(self) -> NoReturn:
        """Re-raise BrokenPipeError for `report_errors`; rich would exit with code 1."""
        raise


def print_json(schema: str, values: dict[str, object]) -> None:
    """Print values as JSON on standard output.

    Args:
        schema: Name and version of the schema; docs/schemas/info.json describes `info/3`.
        values: Values by their names in the schema.
    """
    document = {"schema": f"quarc-ref/{schema}", **values}
    sys.stdout.write(json.dumps(document, indent=2, allow_nan=False) + "\n")


def print_message(message: str) -> None:
    """Write a line to standard error."""
    sys.stderr.write(f"quarc-ref: {escape_controls(message)}\n")


class MessageHandler(logging.Handler):
    """Logging handler that prints each distinct message only once."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._printed: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message of a record, unless the same message was printed before."""
        message = record.getMessage()
        if message not in self._printed:
            self._printed.add(message)
            print_message(message)


def print_fields(title: str, fields: dict[str, str]) -> None:
    """Print a table of names and values on standard output.

    On a terminal that is too narrow for the names, lines are longer than the terminal is wide.

    Args:
        title: Text above the table.
        fields: Values by name; control characters are escaped.
    """
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    rows = {escape_controls(name): escape_controls(value) for name, value in fields.items()}
    for row in rows.items():
        table.add_row(*row)
    output = _PlainConsole()
    output.print(escape_controls(title), style="italic", highlight=False, soft_wrap=True)
    output.width = max(output.width, max(map(cell_len, rows), default=0) + _MIN_VALUE_WIDTH)
    output.print(table)


def print_columns(title: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table with headings on standard output, without wrapping.

    Args:
        title: Text above the table.
        headings: Heading of each column. A leading `<` is not printed and marks a column of text,
            which is aligned to the left; other columns are aligned to the right.
        rows: Cells of each row. Control characters in title, headings and cells are escaped.
    """
    table = Table(title=escape_controls(title), title_justify="left", box=None, pad_edge=False)
    for heading in headings:
        justify: Literal["left", "right"] = "left" if heading.startswith("<") else "right"
        text = escape_controls(heading.removeprefix("<"))
        table.add_column(text, justify=justify, header_style="dim")
    for row in rows:
        table.add_row(*map(escape_controls, row))
    _PlainConsole(_UNLIMITED_WIDTH).print(table)


def escape_controls(text: str) -> str:
    """Return the text with terminal control characters escaped."""
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode()
        for character in text
    )


def warn_about_reference_engine() -> bool:
    """Suggest the fast engine on standard error if a large scene was decoded without it.

    Returns:
        Whether the suggestion was printed.
    """
    from quarc_ref.decoder.engines import explain_missing, would_benefit_from_fast_engine

    is_slow = would_benefit_from_fast_engine()
    if is_slow:
        print_message(f"{explain_missing()}; {_REFERENCE_ENGINE_MESSAGE}")
    return is_slow


class TerminalProgress:
    """Shows progress on standard error: bars on a terminal, otherwise a line every few seconds.

    Use it as a context manager. Without a terminal, short stages and stages that repeat in
    every frame are not shown.

    Args:
        quiet: Whether to show no progress.

    Attributes:
        is_shown: Whether progress is shown.
    """

    _STATUS_STAGES = ("canonical", "frames")
    _LINE_STAGES = (
        *("synth", "canonical", "frames", "segments"),
        *("sync", "features", "inspect", "evaluate", "compare", "decode", "seek", "render"),
    )

    def __init__(self, *, quiet: bool) -> None:
        console = Console(stderr=True)
        self.is_shown = not quiet
        self._status: Callable[[], str] | None = None
        self._bars = Progress(
            TextColumn("{task.description:>10}"),
            BarColumn(),
            MofNCompleteColumn(),
            _RemainingTimeColumn(),
            TextColumn("{task.fields[status]}"),
            console=console,
            transient=True,
            disable=quiet or not console.is_terminal,
        )
        self._prints_lines = not quiet and not console.is_terminal
        self._should_warn_about_engine = not quiet
        self._tasks: dict[str, TaskID] = {}
        self._printed_stages: set[str] = set()
        self._next_line = time.monotonic() + _SECONDS_BETWEEN_LINES

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
        """Update the progress of a stage; a total of 0 means that the total is unknown."""
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=total or None, status="")
        status = self._get_status(stage)
        self._bars.update(self._tasks[stage], completed=done, total=total or None, status=status)
        try:
            if self._prints_lines and stage in self._LINE_STAGES:
                self._print_line(stage, done, total)
            if self._should_warn_about_engine:
                self._should_warn_about_engine = not warn_about_reference_engine()
        except OSError:  # nobody reads it any more, which is no reason to end hours of work
            self._prints_lines = self._should_warn_about_engine = False

    def show_status(self, status: "Callable[[], str]") -> None:
        """Show a status text next to the stages `canonical` and `frames`.

        Args:
            status: Function that returns the status text, such as the remaining time.
        """
        self._status = status

    def announce(self, message: str) -> None:
        """Print a line above the progress bars; control characters are escaped."""
        line = escape_controls(message)
        if self._bars.disable:
            sys.stderr.write(f"{line}\n")
        else:
            self._bars.console.print(line, highlight=False, markup=False)

    def _get_status(self, stage: str) -> str:
        return self._status() if self._status and stage in self._STATUS_STAGES else ""

    def _print_line(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        if now >= self._next_line or (done == total and stage in self._printed_stages):
            self._printed_stages.add(stage)
            self._next_line = now + _SECONDS_BETWEEN_LINES
            count_text = f"{stage} {done}/{total}" if total else f"{stage} {done}"
            status = self._get_status(stage)
            sys.stderr.write(f"{count_text}: {status}\n" if status else f"{count_text}\n")


class _RemainingTimeColumn(TimeRemainingColumn):
    """Column with the remaining time of a stage; empty if the stage has a status text."""

    def render(self, task: Task) -> Text:
        """Return the remaining time of a stage, or an empty text."""
        return Text() if task.fields.get("status") else super().render(task)
