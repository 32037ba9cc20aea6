"""Draws the plots of benchmarks/README.md from the figures in benchmarks/today/.

python benchmarks/today.py
"""

import csv
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

_HERE = Path(__file__).parent / "today"


@dataclass(frozen=True)
class Plot:
    """A plot of `name`.csv: the first column is x, and every other column a line.

    Attributes:
        name: Of the files.
        x: Label.
        y: Label.
        log: Whether both axes are logarithmic.
    """

    name: str
    x: str
    y: str
    log: bool = False


PLOTS = (
    Plot("what_moves", "frame", "PSNR of the moving region, training views, dB"),
    Plot("decoder", "Gaussians", "ms per frame", log=True),
)


def draw(plot: Plot, folder: Path = _HERE) -> bytes:
    """Return the SVG of a plot."""
    with (folder / f"{plot.name}.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    first, *lines = rows[0]
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    for line in lines:
        points = [(float(row[first]), float(row[line])) for row in rows if row[line]]
        axes.plot(*zip(*points, strict=True), marker="o", markersize=4, label=line)
    axes.set(xlabel=plot.x, ylabel=plot.y)
    if plot.log:
        axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    svg = BytesIO()
    with rc_context({"svg.hashsalt": "quarc-ref"}):  # the same file from the same figures
        figure.savefig(svg, format="svg", metadata={"Date": None})
    return svg.getvalue()


def main() -> None:
    """Write the SVG next to each CSV."""
    for plot in PLOTS:
        (_HERE / f"{plot.name}.svg").write_bytes(draw(plot))


if __name__ == "__main__":
    main()
