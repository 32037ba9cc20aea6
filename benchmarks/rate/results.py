"""Collects the rows, claims and points of all captures, and writes them as files."""

import os
import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from atomic_files import write_atomically
from quarc_ref.evaluation.plots import plot_coders, plot_rate_distortion
from quarc_ref.inspection.stream_summary import KILOBYTE, KINDS
from rate.claims import Claim, list_inter_frames
from rate.converters import read_splat_transform_version
from rate.hull import Point, find_upper_hull
from rate.measure import MeasuredStream
from rate.rows import FLOATS, FOURDGS, Row
from rate.tables import (
    format_claims,
    format_csv,
    format_points,
    format_rows,
    list_claim_records,
    list_point_records,
    list_row_records,
)

_PACKAGES = ("numpy", "constriction", "torch", "numba", "zstandard", "fourdgs")


@dataclass(frozen=True, slots=True)
class Results:
    """All results of a run; claims and points are stored by name of the capture."""

    rows: list[Row] = field(default_factory=list)
    later_frame_counts: dict[tuple[str, str], int] = field(default_factory=dict)
    claims: dict[str, list[Claim]] = field(default_factory=dict)
    points: dict[str, list[Point]] = field(default_factory=dict)

    def add(self, stream: MeasuredStream, rows: list[Row]) -> None:
        """Add the rows of a stream."""
        self.rows.extend(rows)
        self.later_frame_counts[rows[0].capture, rows[0].preset] = len(
            list_inter_frames(stream.summary)
        )

    def format_markdown(self) -> str:
        """Return all tables as Markdown."""
        tables = [format_rows(self.rows, self.later_frame_counts), format_claims(self.claims)]
        return "\n".join([*tables, *([format_points(self.points)] if self.points else [])])

    def as_json(self, folder: Path) -> dict[str, object]:
        """Return the results as the JSON object that `--json` prints."""
        return {
            "machine": describe_machine(folder),
            "rows": list_row_records(self.rows),
            "claims": list_claim_records(self.claims),
            "sweep": list_point_records(self.points),
        }


def write_files(results: Results, folder: Path) -> None:
    """Write the tables, as Markdown and CSV, and the plots."""
    tables = {
        "rate.csv": list_row_records(results.rows),
        "claims.csv": list_claim_records(results.claims),
        "sweep.csv": list_point_records(results.points),
    }
    for name, records in tables.items():
        if records:
            write_atomically(folder / name, format_csv(records))
    write_atomically(folder / "rate.md", results.format_markdown().encode())
    for capture in results.claims:
        write_atomically(
            folder / f"{capture}.coders.png", plot_coders(_list_panels(results, capture))
        )
    for capture, points in results.points.items():
        write_atomically(folder / f"{capture}.sweep.png", _plot_points(points))


def describe_machine(folder: Path) -> dict[str, object]:
    """Return a description of the machine, and the versions of the software."""
    return {
        "processor": _read_processor(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        **{name: _read_version(name) for name in _PACKAGES},
        "splat-transform": read_splat_transform_version(folder),
    }


def _list_panels(results: Results, capture: str) -> dict[str, dict[str, float]]:
    """Return the bars of each panel in the plot of a capture, as `{title: {format: KB}}`.

    Raw floats are left out because they are far larger, and so are formats without SH.
    """
    panels: dict[str, dict[str, float]] = {}
    for kind in KINDS:
        is_canonical = kind == "canonical"
        sizes = {}
        for row in results.rows:
            is_left_out = row.coder.startswith((FLOATS, FOURDGS))
            if row.capture == capture and getattr(row, kind) and not is_left_out:
                frames = 1 if is_canonical else results.later_frame_counts[capture, row.preset]
                sizes[f"{row.preset}: {row.coder}"] = getattr(row, kind) / KILOBYTE / frames
        if sizes:
            panels[f"{kind}, KB" if is_canonical else f"{kind}, KB per frame"] = sizes
    return panels


def _plot_points(points: list[Point]) -> bytes:
    labeled_points = [(point.kilobytes, point.psnr, point.label) for point in points]
    hull = [(point.kilobytes, point.psnr) for point in find_upper_hull(points)]
    return plot_rate_distortion(labeled_points, hull)


def _read_processor() -> str:
    """Return the model of the processor; on Linux, as `/proc/cpuinfo` names it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _read_version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
