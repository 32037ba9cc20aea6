"""Rows of results, the log files to which steps append them, and the table of all rows."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

_HEADERS = ("step", "quantity", "measured", "limit", "holds")


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the table of results.

    Attributes:
        step: Name of the step.
        what: Name of the measured quantity.
        result: Measured value as text.
        asked: Requirement that the result must meet; empty if there is none.
        holds: Whether the requirement is met; None if there is none.
        figures: Numeric values of the result, by name.
    """

    step: str
    what: str
    result: str
    asked: str = ""
    holds: bool | None = None
    figures: dict[str, float] = field(default_factory=dict)


class RowLog:
    """A file to which a step appends every row at once; rows are kept if the step is killed."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def add(self, row: Row) -> None:
        """Append a row."""
        self._write({"row": asdict(row)})

    def write_progress(self, progress: str) -> None:
        """Append a progress message of the step."""
        self._write({"progress": progress})

    def read(self) -> tuple[list[Row], str]:
        """Return the rows in the file, and the last progress message."""
        if not self._path.exists():
            return [], ""
        complete_lines = self._path.read_text().rpartition("\n")[0]
        lines = [json.loads(line) for line in complete_lines.splitlines()]
        rows = [Row(**line["row"]) for line in lines if "row" in line]
        progress_notes = [line["progress"] for line in lines if "progress" in line]
        return rows, progress_notes[-1] if progress_notes else ""

    def _write(self, line: dict[str, object]) -> None:
        with self._path.open("a") as file:
            file.write(json.dumps(line) + "\n")


def format_table(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    holds = {True: "yes", False: "**no**", None: ""}
    cells = [(row.step, row.what, row.result, row.asked, holds[row.holds]) for row in rows]
    lines = [_HEADERS, ("---",) * len(_HEADERS), *cells]
    return "".join(f"| {' | '.join(map(_escape, line))} |\n" for line in lines)


def write_tables(rows: Sequence[Row], folder: Path) -> None:
    """Write the rows to `gpu.md` and `gpu.json` in a folder; existing files are replaced."""
    finite_rows = [{**asdict(row), "figures": _drop_nonfinite(row.figures)} for row in rows]
    (folder / "gpu.md").write_text(format_table(rows))
    (folder / "gpu.json").write_text(
        json.dumps({"rows": finite_rows}, indent=2, allow_nan=False) + "\n"
    )


def _escape(cell: str) -> str:
    return " ".join(cell.replace("|", "/").split())


def _drop_nonfinite(figures: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in figures.items() if math.isfinite(value)}
