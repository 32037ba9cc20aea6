"""Writes the results: tables, plots, claims and the page."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

from kept_files import write_atomically
from paper.claims import list_claims
from paper.experiments import Experiment, Point
from paper.page import Section, compose_page
from paper.tables import format_markdown, write_csv
from quarc_ref.evaluation.plots import Curve, plot_curves
from rate.tables import format_claims
from studies import Row

Rows = Mapping[str, Row]

_DOUBLED = ("step", "gradient")  # axes with values that double from one to the next


def write_results(
    experiments: Sequence[Experiment], rows: Rows, folder: Path, capture: str, preset: str
) -> Path:
    """Write all results; return the path of the page.

    Args:
        experiments: What is compared.
        rows: Completed rows by the trial's name, at least one.
        folder: Where to.
        capture: Its name.
        preset: Settings of the full method, as text.
    """
    title = f"{capture}: the paper's experiments, preset {preset}"
    sections = [_make_section(experiment, rows) for experiment in experiments]
    claims = list_claims(
        {
            section.experiment.name: {row["label"]: row for row in section.rows}
            for section in sections
            if len(section.rows) == len(section.experiment.points)
        }
    )
    listed = [(section.experiment.name, row) for section in sections for row in section.rows]
    tables = [
        f"### {section.experiment.title}\n\n{format_markdown(section.rows)}"
        for section in sections
        if section.rows
    ]
    files = {
        "paper.csv": write_csv(listed),
        "paper.md": "\n".join([format_claims({capture: claims}), *tables]).encode(),
        **{name: png for section in sections for name, png in section.plots.items()},
        "index.html": compose_page(title, sections, claims),
    }
    for name, data in files.items():
        write_atomically(folder / name, data)
    return folder / "index.html"


def _make_section(experiment: Experiment, rows: Rows) -> Section:
    done = [
        (point, rows[point.trial.name] | {"label": point.label, "title": experiment.title})
        for point in experiment.points
        if point.trial.name in rows
    ]
    plots = {f"{experiment.name}.png": _plot(experiment, done)} if done else {}
    return Section(experiment, [row for _, row in done], plots)


def _plot(experiment: Experiment, done: Sequence[tuple[Point, Row]]) -> bytes:
    """Return the plot of an experiment: along its axis, or by frame if it has none."""
    if experiment.axis and len(done) > 1:
        panels = {
            "PSNR, held out (dB)": _join(done, lambda row: row["quality"]["psnr"]),
            "KB per frame": _join(done, lambda row: row["bytes"]["kb_per_frame"]),
        }
        if experiment.name == "gradient":
            panels["newborn per frame"] = _join(done, lambda row: fmean(row["births"][1:]))
        return plot_curves(panels, experiment.axis, is_log2=experiment.name in _DOUBLED)
    panels = {"PSNR, held out (dB)": _follow(done, lambda row: row["per_frame"]["psnr"])}
    if experiment.name in {"full", "gate"}:
        panels["newborn so far"] = _follow(done, _accumulate_births)
        panels["Gaussians"] = _follow(done, lambda row: row["gaussians"])
    return plot_curves(panels, "frame")


def _join(done: Sequence[tuple[Point, Row]], tell: Callable[[Row], Any]) -> dict[str, Curve]:
    """Return the curves along the axis, one for each series."""
    curves = {}
    for series in dict.fromkeys(point.series for point, _ in done):
        subset = [(point.x, tell(row)) for point, row in done if point.series == series]
        curves[series] = Curve(*(list(numbers) for numbers in zip(*subset, strict=True)))
    return curves


def _follow(done: Sequence[tuple[Point, Row]], tell: Callable[[Row], Any]) -> dict[str, Curve]:
    curves = {}
    for point, row in done:
        numbers = tell(row)
        curves[point.label] = Curve(list(range(len(numbers))), list(numbers))
    return curves


def _accumulate_births(row: Row) -> list[int]:
    return [sum(row["births"][: frame + 1]) for frame in range(len(row["births"]))]
