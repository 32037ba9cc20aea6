"""Formats tables of several captures as in the paper: a row for each scene, and one for the mean.

Scenes are grouped by the parent folders of their captures, such as `N3DV` and `MeetRoom`.
"""

from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean
from typing import Any

from paper.experiments import Experiment
from rate.tables import format_csv, format_table
from studies import Row

AMORTIZED_FRAMES = 300  # number of frames over which the paper amortizes frame 0
_MEAN_LABEL = "mean"

# Heading, value and format of each column.
_COLUMNS = (
    ("PSNR", lambda row: row["quality"]["psnr"], ".2f"),
    ("SSIM", lambda row: row["quality"]["ssim"], ".4f"),
    ("LPIPS", lambda row: row["quality"]["lpips"], ".4f"),
    ("KB / frame", lambda row: row["bytes"]["kb_per_frame"], ".2f"),
    (f"KB / frame with frame 0 spread over {AMORTIZED_FRAMES}", lambda row: _amortize(row), ".2f"),
    ("births / frame", lambda row: fmean(row["births"][1:] or [0]), ".0f"),
    ("s / frame", lambda row: row["seconds"]["frame"], ".2f"),
    ("frames", lambda row: row["frames"], ".0f"),
)

Scene = tuple[str, str]  # group and name
Scenes = Mapping[Scene, Mapping[str, Row]]  # rows of each scene, by the trial's name


def format_scenes(experiments: Sequence[Experiment], scenes: Scenes) -> str:
    """Return Markdown tables: for the full method, all scenes; for other trials, only means.

    Args:
        experiments: Experiments of the studies.
        scenes: Completed rows of each scene.
    """
    blocks = []
    for group in dict.fromkeys(group for group, _ in scenes):
        group_rows = {
            name: rows for (scene_group, name), rows in scenes.items() if scene_group == group
        }
        blocks.append(f"## {group}\n")
        for experiment in experiments:
            lines = list(_list_lines(experiment, group_rows))
            if lines:
                header = ["", *(name for name, *_ in _COLUMNS)]
                blocks.append(f"### {experiment.title}\n\n{format_table(header, lines)}")
    return "\n".join(blocks)


def format_scenes_csv(experiments: Sequence[Experiment], scenes: Scenes) -> bytes:
    """Return CSV with a line for each trial on each scene."""
    return format_csv(
        [
            {"group": group, "scene": name, "experiment": experiment.name, "label": point.label}
            | {heading: get_value(rows[point.trial.name]) for heading, get_value, _ in _COLUMNS}
            for (group, name), rows in scenes.items()
            for experiment in experiments
            for point in experiment.points
            if point.trial.name in rows
        ]
    )


def _list_lines(
    experiment: Experiment, group_rows: Mapping[str, Mapping[str, Row]]
) -> Iterator[list[str]]:
    """Yield a line of means for each trial; if there is only one trial, also a line per scene."""
    for point in experiment.points:
        trial_rows = {name: rows[point.trial.name] for name, rows in group_rows.items()
                 if point.trial.name in rows}  # fmt: skip
        if len(experiment.points) == 1:
            for name, row in trial_rows.items():
                yield [name, *_format_means([row])]
        if trial_rows:
            missing_count = len(group_rows) - len(trial_rows)
            label = _MEAN_LABEL if len(experiment.points) == 1 else point.label
            yield [
                label + (f" ({missing_count} missing)" if missing_count else ""),
                *_format_means(trial_rows.values()),
            ]


def _format_means(rows: Any) -> list[str]:  # noqa: ANN401
    """Return the mean of each column as text; empty for a column in which no row has a value."""
    cells = []
    for _, get_value, format_spec in _COLUMNS:
        values = [value for row in rows if (value := get_value(row)) is not None]
        cells.append(format(fmean(values), format_spec) if values else "")
    return cells


def _amortize(row: Row) -> float:
    later_kilobytes = row["bytes"]["kb_per_frame"] * (AMORTIZED_FRAMES - 1)
    total: float = (row["bytes"]["canonical_kb"] + later_kilobytes) / AMORTIZED_FRAMES
    return total
