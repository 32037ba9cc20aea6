"""Draws the plots of benchmarks/README.md from the CSV files in benchmarks/today/.

python benchmarks/today.py
"""

import csv
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

_FOLDER = Path(__file__).parent / "today"


@dataclass(frozen=True)
class Plot:
    """A plot of a CSV file, whose first column has the x values; every other column is a line.

    Attributes:
        name: Name of the CSV file and the SVG file, without suffix.
        x_label: Label of the x axis.
        y_label: Label of the y axis.
        is_log: Whether both axes are logarithmic.
    """

    name: str
    x_label: str
    y_label: str
    is_log: bool = False


PLOTS = (
    Plot("what_moves", "frame", "PSNR of the moving region, training views, dB"),
    Plot("decoder", "Gaussians", "ms per frame", is_log=True),
)


def draw_plot(plot: Plot, folder: Path = _FOLDER) -> bytes:
    """Return a plot as SVG."""
    with (folder / f"{plot.name}.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    x_column, *line_columns = rows[0]
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    for line_column in line_columns:
        points = [
            (float(row[x_column]), float(row[line_column])) for row in rows if row[line_column]
        ]
        axes.plot(*zip(*points, strict=True), marker="o", markersize=4, label=line_column)
    axes.set(xlabel=plot.x_label, ylabel=plot.y_label)
    if plot.is_log:
        axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    svg = BytesIO()
    with rc_context({"svg.hashsalt": "quarc-ref"}):  # so that equal data give equal files
        figure.savefig(svg, format="svg", metadata={"Date": None})
    return svg.getvalue()


def main() -> None:
    """Write the SVG of each plot next to its CSV file."""
    for plot in PLOTS:
        (_FOLDER / f"{plot.name}.svg").write_bytes(draw_plot(plot))


if __name__ == "__main__":
    main()
