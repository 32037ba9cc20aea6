"""The paper's tables for several captures: a line for each scene and one for their mean.

Scenes are grouped by the parent folders of their captures, such as `N3DV` and `MeetRoom`.
"""

from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean
from typing import Any

from paper.experiments import Experiment
from rate.tables import format_table, write_csv
from studies import Row

AMORTIZED_FRAMES = 300  # over which the paper amortizes frame 0
_MEAN = "mean"

# Heading, value, and format of each column of the paper's tables of scenes.
_COLUMNS = (
    ("PSNR", lambda row: row["quality"]["psnr"], ".2f"),
    ("SSIM", lambda row: row["quality"]["ssim"], ".4f"),
    ("LPIPS", lambda row: row["quality"]["lpips"], ".4f"),
    ("KB / frame", lambda row: row["bytes"]["kb_per_frame"], ".2f"),
    (f"with frame 0 over {AMORTIZED_FRAMES}", lambda row: _amortize(row), ".2f"),
    ("newborn / frame", lambda row: fmean(row["births"][1:] or [0]), ".0f"),
    ("s / frame", lambda row: row["seconds"]["frame"], ".2f"),
    ("frames", lambda row: row["frames"], ".0f"),
)

Scene = tuple[str, str]  # group and name
Scenes = Mapping[Scene, Mapping[str, Row]]  # rows of each scene, by the trial's name


def format_scenes(experiments: Sequence[Experiment], scenes: Scenes) -> str:
    """Return the tables as Markdown: each scene of the full method, and means of all other trials.

    Args:
        experiments: What is compared.
        scenes: Completed rows.
    """
    parts = []
    for group in dict.fromkeys(group for group, _ in scenes):
        chosen = {name: rows for (its, name), rows in scenes.items() if its == group}
        parts.append(f"## {group}\n")
        for experiment in experiments:
            lines = list(_list_lines(experiment, chosen))
            if lines:
                head = ["", *(name for name, *_ in _COLUMNS)]
                parts.append(f"### {experiment.title}\n\n{format_table(head, lines)}")
    return "\n".join(parts)


def write_scenes_csv(experiments: Sequence[Experiment], scenes: Scenes) -> bytes:
    """Return a line of numbers for every trial of every scene."""
    return write_csv(
        [
            {"group": group, "scene": name, "experiment": experiment.name, "label": point.label}
            | {heading: get(rows[point.trial.name]) for heading, get, _ in _COLUMNS}
            for (group, name), rows in scenes.items()
            for experiment in experiments
            for point in experiment.points
            if point.trial.name in rows
        ]
    )


def _list_lines(
    experiment: Experiment, chosen: Mapping[str, Mapping[str, Row]]
) -> Iterator[list[str]]:
    """Yield the lines of an experiment: each scene of a single trial, otherwise the means."""
    for point in experiment.points:
        found = {name: rows[point.trial.name] for name, rows in chosen.items()
                 if point.trial.name in rows}  # fmt: skip
        if len(experiment.points) == 1:
            for name, row in found.items():
                yield [name, *_format([row])]
        if found:
            missing = len(chosen) - len(found)
            label = _MEAN if len(experiment.points) == 1 else point.label
            yield [label + (f" ({missing} missing)" if missing else ""), *_format(found.values())]


def _format(rows: Any) -> list[str]:  # noqa: ANN401
    """Return the means of rows as cells; empty if no row has a number."""
    cells = []
    for _, get, how in _COLUMNS:
        values = [value for row in rows if (value := get(row)) is not None]
        cells.append(format(fmean(values), how) if values else "")
    return cells


def _amortize(row: Row) -> float:
    later = row["bytes"]["kb_per_frame"] * (AMORTIZED_FRAMES - 1)
    total: float = (row["bytes"]["canonical_kb"] + later) / AMORTIZED_FRAMES
    return total
