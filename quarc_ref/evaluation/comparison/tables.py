"""Formats a comparison as tables, CSV and JSON."""

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict

from quarc_ref.evaluation.comparison.bd_rate import Delta
from quarc_ref.evaluation.comparison.measure import Comparison
from quarc_ref.evaluation.comparison.summary import Point, Spread, Summary
from quarc_ref.evaluation.metrics import MAX_DECIBELS

_NOTHING = "-"
# Heading, name of the metric, format.
FIGURES = (
    ("PSNR", "psnr", ".2f"),
    ("SSIM", "ssim", ".4f"),
    ("LPIPS", "lpips", ".4f"),
    ("cc PSNR", "cc_psnr", ".2f"),
    ("moving", "moving_psnr", ".2f"),
    ("static", "static_psnr", ".2f"),
    ("flicker", "flicker", ".3f"),
)

POINT_COLUMNS = ("entry", "is", "runs", "bytes", "KB / frame", "Mb/s", "dB to first", "better")


def point_headings(summary: Summary) -> list[str]:
    """Return the headings of `format_point_rows`."""
    figures = [heading for heading, name, _ in FIGURES if name in summary.points[0].figures]
    return [*POINT_COLUMNS[:3], *figures, *POINT_COLUMNS[3:]]


def format_point_rows(summary: Summary) -> list[list[str]]:
    """Return a row of nonempty cells for each operating point."""
    return [_row_point(point) for point in summary.points]


def delta_headings(summary: Summary) -> list[str]:
    """Return the headings of `format_delta_rows`."""
    return [f"against {summary.reference}", "BD-rate", "BD-PSNR", "BD-rate by SSIM", "remark"]


def format_delta_rows(summary: Summary) -> list[list[str]]:
    """Return a row of cells for each method with Bjontegaard deltas."""
    return [
        [
            each.method,
            _percent(each.psnr),
            _NOTHING if each.psnr.quality is None else f"{each.psnr.quality:+.2f} dB",
            _percent(each.ssim),
            each.psnr.remark or each.ssim.remark or _NOTHING,
        ]
        for each in summary.deltas
    ]


def note_equal_views(comparison: Comparison) -> list[str]:
    """Return a remark on each entry with views that equal the ground truth."""
    remarks = []
    for each in comparison.measured:
        equal, views = each.quality.count_views()
        if equal:
            remarks.append(
                f"{each.label}: {equal} of {views} views equal the truth; each counts as "
                f"{MAX_DECIBELS:g} dB in means and differences"
            )
    return remarks


def format_points_csv(summary: Summary) -> bytes:
    """Format a CSV line for each operating point."""
    lines = []
    for point in summary.points:
        line: dict[str, object] = {
            "method": point.label.method,
            "point": point.label.point,
            "kind": point.kind,
            "runs": point.runs,
        }
        spreads = {
            **point.figures,
            "bytes": point.byte_count,
            "kb_per_frame": point.kilobytes_per_frame,
            "psnr_to_first": None if point.paired is None else point.paired.psnr,
        }
        for name, each in spreads.items():
            line[name] = _mean(each)
            line[f"{name}_deviation"] = _deviation(each)
        line["better_than_first"] = None if point.paired is None else point.paired.better
        lines.append(line)
    return _format_csv(lines)


def format_views_csv(comparison: Comparison) -> bytes:
    """Format a CSV line for each view: entry, run, camera, frame and all metrics."""
    runs: dict[object, int] = {}
    lines = []
    for each in comparison.measured:
        run = runs[each.label] = runs.get(each.label, -1) + 1
        for camera, views in each.quality.per_camera.items():
            for frame, figures in zip(comparison.frames, views, strict=True):
                said = {"method": each.label.method, "point": each.label.point, "run": run}
                lines.append({**said, "camera": camera, "frame": frame, **figures})
    return _format_csv(lines)


def as_json(comparison: Comparison, summary: Summary) -> dict[str, object]:
    """Return the output of `compare --json`."""
    return {
        "truth": comparison.truth,
        "frames": list(comparison.frames),
        "cameras": list(comparison.cameras),
        "frames_per_second": comparison.frames_per_second,
        "points": [_point_as_json(point) for point in summary.points],
        "reference": summary.reference,
        "bd": [
            {"method": each.method, "psnr": asdict(each.psnr), "ssim": asdict(each.ssim)}
            for each in summary.deltas
        ],
        "metrics": comparison.variants,
    }


def _row_point(point: Point) -> list[str]:
    figures = [
        format_spread(point.figures[name], how) for _, name, how in FIGURES if name in point.figures
    ]
    rate, paired = point.megabits_per_second, point.paired
    difference = None if paired is None else paired.psnr
    return [
        str(point.label),
        point.kind,
        str(point.runs),
        *figures,
        format_spread(point.byte_count, ",.0f"),
        format_spread(point.kilobytes_per_frame, ",.2f"),
        _NOTHING if rate is None else f"{rate:.2f}",
        format_spread(difference, "+.2f"),
        _NOTHING if paired is None else f"{paired.better:.0%} of {paired.pairs}",
    ]


def format_spread(found: Spread | None, how: str) -> str:
    """Format a mean, with its deviation if there is one."""
    if found is None:
        return _NOTHING
    mean = format(found.mean, how)
    return mean if found.deviation is None else f"{mean} ± {found.deviation:{how.strip('+')}}"


def _mean(found: Spread | None) -> float | None:
    return None if found is None else found.mean


def _deviation(found: Spread | None) -> float | None:
    return None if found is None else found.deviation


def _percent(delta: Delta) -> str:
    return _NOTHING if delta.rate is None else f"{delta.rate:+.1f} %"


def _point_as_json(point: Point) -> dict[str, object]:
    return {
        "method": point.label.method,
        "point": point.label.point,
        "kind": point.kind,
        "runs": point.runs,
        "quality": {name: _mean(it) for name, it in point.figures.items()},
        "deviation": {name: _deviation(it) for name, it in point.figures.items()},
        "bytes": _mean(point.byte_count),
        "kb_per_frame": _mean(point.kilobytes_per_frame),
        "megabits_per_second": point.megabits_per_second,
        "paired": None
        if point.paired is None
        else {
            "psnr": point.paired.psnr.mean,
            "deviation": point.paired.psnr.deviation,
            "better": point.paired.better,
            "pairs": point.paired.pairs,
        },
    }


def _format_csv(lines: Sequence[dict[str, object]]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, _name_columns(lines), lineterminator="\n")
    writer.writeheader()
    for line in lines:
        writer.writerow({name: _cell(value) for name, value in line.items()})
    return text.getvalue().encode()


def _name_columns(lines: Iterable[dict[str, object]]) -> list[str]:
    return list(dict.fromkeys(name for line in lines for name in line))


def _cell(value: object) -> object:
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value
