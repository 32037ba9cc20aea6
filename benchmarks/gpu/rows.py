"""The results of steps, row by row, and the table of all rows."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

_HEADS = ("step", "what", "is", "asked", "holds")


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the table.

    Attributes:
        step: Name of the step.
        what: Was measured.
        result: As text.
        asked: Requirement for the result; empty if there is none.
        holds: Whether the requirement is met; None without one.
        figures: Numbers of the result by name.
    """

    step: str
    what: str
    result: str
    asked: str = ""
    holds: bool | None = None
    figures: dict[str, float] = field(default_factory=dict)


class Notebook:
    """A file into which a step writes each row at once, so that none is lost if it is stopped."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def add(self, row: Row) -> None:
        """Write a row."""
        self._write({"row": asdict(row)})

    def note(self, progress: str) -> None:
        """Write the progress of the step."""
        self._write({"progress": progress})

    def read(self) -> tuple[list[Row], str]:
        """Return the rows so far and the last progress of the step."""
        if not self._path.exists():
            return [], ""
        whole = self._path.read_text().rpartition("\n")[0]
        lines = [json.loads(line) for line in whole.splitlines()]
        rows = [Row(**line["row"]) for line in lines if "row" in line]
        notes = [line["progress"] for line in lines if "progress" in line]
        return rows, notes[-1] if notes else ""

    def _write(self, line: dict[str, object]) -> None:
        with self._path.open("a") as file:
            file.write(json.dumps(line) + "\n")


def format_table(rows: Sequence[Row]) -> str:
    """Return rows as a table in Markdown."""
    holds = {True: "yes", False: "**no**", None: ""}
    cells = [(row.step, row.what, row.result, row.asked, holds[row.holds]) for row in rows]
    lines = [_HEADS, ("---",) * len(_HEADS), *cells]
    return "".join(f"| {' | '.join(map(_escape, line))} |\n" for line in lines)


def write_tables(rows: Sequence[Row], folder: Path) -> None:
    """Write the rows as `gpu.md` and `gpu.json` into a folder, replacing older ones."""
    finite = [{**asdict(row), "figures": _drop_nonfinite(row.figures)} for row in rows]
    (folder / "gpu.md").write_text(format_table(rows))
    (folder / "gpu.json").write_text(json.dumps({"rows": finite}, indent=2, allow_nan=False) + "\n")


def _escape(cell: str) -> str:
    return " ".join(cell.replace("|", "/").split())


def _drop_nonfinite(figures: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in figures.items() if math.isfinite(value)}
