"""Writes the results of a study: tables, plots, claims and a page."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from atomic_files import write_atomically
from paper.claims import list_claims
from paper.experiments import Experiment, Point
from paper.page import Section, compose_page
from paper.tables import format_markdown, format_study_csv
from quarc_ref.evaluation.plots import Curve, plot_curves
from rate.claims import mean
from rate.tables import format_claims
from studies import Row

Rows = Mapping[str, Row]

_LOG2_EXPERIMENTS = (
    "step",
    "gradient",
)  # experiments whose values on the axis double from trial to trial


def write_results(
    experiments: Sequence[Experiment], rows: Rows, folder: Path, capture: str, preset: str
) -> Path:
    """Write all results; return the path of the page.

    Args:
        experiments: Experiments of the study.
        rows: Completed rows by trial name; at least one.
        folder: Folder for the files.
        capture: Name of the capture.
        preset: Settings of the full method, as text.
    """
    title = f"{capture}: the paper's experiments with preset {preset}"
    sections = [_make_section(experiment, rows) for experiment in experiments]
    claims = list_claims(
        {
            section.experiment.name: {row["label"]: row for row in section.rows}
            for section in sections
            if len(section.rows) == len(section.experiment.points)
        }
    )
    named_rows = [(section.experiment.name, row) for section in sections for row in section.rows]
    tables = [
        f"### {section.experiment.title}\n\n{format_markdown(section.rows)}"
        for section in sections
        if section.rows
    ]
    data_by_name = {
        "paper.csv": format_study_csv(named_rows),
        "paper.md": "\n".join([format_claims({capture: claims}), *tables]).encode(),
        **{name: png for section in sections for name, png in section.plots.items()},
        "index.html": compose_page(title, sections, claims),
    }
    for name, data in data_by_name.items():
        write_atomically(folder / name, data)
    return folder / "index.html"


def _make_section(experiment: Experiment, rows: Rows) -> Section:
    completed_points = [
        (point, rows[point.trial.name] | {"label": point.label, "title": experiment.title})
        for point in experiment.points
        if point.trial.name in rows
    ]
    plots = (
        {f"{experiment.name}.png": _plot_experiment(experiment, completed_points)}
        if completed_points
        else {}
    )
    return Section(experiment, [row for _, row in completed_points], plots)


def _plot_experiment(
    experiment: Experiment, completed_points: Sequence[tuple[Point, Row]]
) -> bytes:
    """Return the plot of an experiment over its axis, or over the frames if it has no axis."""
    if experiment.axis and len(completed_points) > 1:
        panels = {
            "PSNR on held-out cameras (dB)": _make_axis_curves(
                completed_points, lambda row: row["quality"]["psnr"]
            ),
            "KB per frame": _make_axis_curves(
                completed_points, lambda row: row["bytes"]["kb_per_frame"]
            ),
        }
        if experiment.name == "gradient":
            panels["births per frame"] = _make_axis_curves(
                completed_points, lambda row: mean(row["births"][1:])
            )
        return plot_curves(panels, experiment.axis, is_log2=experiment.name in _LOG2_EXPERIMENTS)
    panels = {
        "PSNR on held-out cameras (dB)": _make_frame_curves(
            completed_points, lambda row: row["per_frame"]["psnr"]
        )
    }
    if experiment.name in {"full", "gate"}:
        panels["births up to the frame"] = _make_frame_curves(completed_points, _accumulate_births)
        panels["Gaussians"] = _make_frame_curves(completed_points, lambda row: row["gaussians"])
    return plot_curves(panels, "frame")


def _make_axis_curves(
    completed_points: Sequence[tuple[Point, Row]], get_value: Callable[[Row], Any]
) -> dict[str, Curve]:
    """Return a curve for each series, plotted against the axis of the experiment."""
    curves = {}
    for series in dict.fromkeys(point.series for point, _ in completed_points):
        points = [
            (point.x, get_value(row)) for point, row in completed_points if point.series == series
        ]
        curves[series] = Curve(*(list(numbers) for numbers in zip(*points, strict=True)))
    return curves


def _make_frame_curves(
    completed_points: Sequence[tuple[Point, Row]], get_value: Callable[[Row], Any]
) -> dict[str, Curve]:
    curves = {}
    for point, row in completed_points:
        values = get_value(row)
        curves[point.label] = Curve(list(range(len(values))), list(values))
    return curves


def _accumulate_births(row: Row) -> list[int]:
    return [sum(row["births"][: frame + 1]) for frame in range(len(row["births"]))]
