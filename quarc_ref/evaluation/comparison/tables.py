"""Formats a comparison as tables, CSV and JSON."""

import csv
import io
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict

from quarc_ref.evaluation.comparison.bd_rate import BjontegaardDeltas
from quarc_ref.evaluation.comparison.measure import Comparison
from quarc_ref.evaluation.comparison.summary import OperatingPoint, Statistics, Summary
from quarc_ref.evaluation.metrics import MAX_DECIBELS
from quarc_ref.wording import replace_unprintable

_MISSING = "-"
_FORMULA_STARTS = ("=", "+", "-", "@")  # in spreadsheets, unless a quotation mark precedes them
# Heading, name of the metric, format.
COMPARE_METRIC_COLUMNS = (
    ("PSNR", "psnr", ".2f"),
    ("SSIM", "ssim", ".4f"),
    ("LPIPS", "lpips", ".4f"),
    ("cc PSNR", "cc_psnr", ".2f"),
    ("moving", "moving_psnr", ".2f"),
    ("static", "static_psnr", ".2f"),
    ("flicker", "flicker", ".3f"),
)

POINT_HEADINGS = ("entry", "kind", "runs", "bytes", "KB / frame", "Mb/s", "dB to first", "better")


def list_point_headings(summary: Summary) -> list[str]:
    """Return the headings of `format_point_rows`."""
    metrics = [
        heading for heading, name, _ in COMPARE_METRIC_COLUMNS if name in summary.points[0].metrics
    ]
    return [*POINT_HEADINGS[:3], *metrics, *POINT_HEADINGS[3:]]


def format_point_rows(summary: Summary) -> list[list[str]]:
    """Return a table row for each operating point; no cell is empty."""
    return [_format_point_row(point) for point in summary.points]


def list_delta_headings(summary: Summary) -> list[str]:
    """Return the headings of `format_delta_rows`."""
    return [f"against {summary.reference}", "BD-rate", "BD-PSNR", "BD-rate by SSIM", "remark"]


def format_delta_rows(summary: Summary) -> list[list[str]]:
    """Return a table row for each method that has Bjontegaard deltas."""
    return [
        [
            deltas.method,
            _format_bd_rate(deltas.psnr),
            _MISSING if deltas.psnr.quality is None else f"{deltas.psnr.quality:+z.2f} dB",
            _format_bd_rate(deltas.ssim),
            deltas.psnr.remark or deltas.ssim.remark or _MISSING,
        ]
        for deltas in summary.deltas
    ]


def list_remarks(comparison: Comparison) -> list[str]:
    """Return the remarks of a comparison, and those on its measurements.

    These are about entries with views that equal the truth, whose PSNR is `MAX_DECIBELS`, and
    about runs of a point with the same results, which say nothing about the deviation over seeds.
    """
    remarks = list(comparison.remarks)
    for entry in comparison.measured_entries:
        equal_count, view_count = entry.quality.count_views_at_max_psnr()
        if equal_count:
            remarks.append(
                f"{entry.label} equals the truth in {equal_count} of {view_count} views; each of "
                f"them counts as {MAX_DECIBELS:g} dB in means and differences"
            )
    repeated = [
        entry.label
        for entry, other in itertools.combinations(comparison.measured_entries, 2)
        if entry.label == other.label and entry.quality.per_camera == other.quality.per_camera
    ]
    remarks += [
        f"runs of {label} have the same results, so their deviation is too small: runs need "
        "different seeds"
        for label in dict.fromkeys(repeated)
    ]
    return remarks


def format_points_csv(summary: Summary) -> bytes:
    """Format the operating points as CSV, one per line."""
    lines = []
    for point in summary.points:
        line: dict[str, object] = {
            "method": point.label.method,
            "point": point.label.point,
            "kind": point.kind,
            "runs": point.run_count,
        }
        statistics_by_name = {
            **point.metrics,
            "bytes": point.byte_count,
            "kb_per_frame": point.kilobytes_per_frame,
            "psnr_to_first": None
            if point.paired_difference is None
            else point.paired_difference.psnr,
        }
        for name, statistics in statistics_by_name.items():
            line[name] = _mean_or_none(statistics)
            line[f"{name}_deviation"] = _deviation_or_none(statistics)
        line["bytes_stated"] = point.is_size_stated
        line["better_than_first"] = (
            None if point.paired_difference is None else point.paired_difference.better_share
        )
        lines.append(line)
    return _format_csv(lines)


def format_views_csv(comparison: Comparison) -> bytes:
    """Format the measured views as CSV, one per line: entry, run, camera, frame and metrics."""
    last_run_by_label: dict[object, int] = {}
    lines = []
    for entry in comparison.measured_entries:
        run = last_run_by_label[entry.label] = last_run_by_label.get(entry.label, -1) + 1
        for camera, views in entry.quality.per_camera.items():
            for frame, metrics in zip(comparison.frames, views, strict=True):
                labels = {"method": entry.label.method, "point": entry.label.point, "run": run}
                if metrics:
                    lines.append({**labels, "camera": camera, "frame": frame, **metrics})
    return _format_csv(lines)


def as_json(comparison: Comparison, summary: Summary) -> dict[str, object]:
    """Return the output of `compare --json`."""
    return {
        "truth": comparison.truth_description,
        "frames": list(comparison.frames),
        "cameras": list(comparison.cameras),
        "frames_per_second": comparison.frames_per_second,
        "points": [_point_as_json(point) for point in summary.points],
        "reference": summary.reference,
        "bd": [
            {"method": delta.method, "psnr": asdict(delta.psnr), "ssim": asdict(delta.ssim)}
            for delta in summary.deltas
        ],
        "metrics": comparison.variants,
        "protocol": comparison.protocol.as_json(),
    }


def _format_point_row(point: OperatingPoint) -> list[str]:
    metrics = [
        format_statistics(point.metrics[name], format_spec)
        for _, name, format_spec in COMPARE_METRIC_COLUMNS
        if name in point.metrics
    ]
    rate, paired_difference = point.megabits_per_second, point.paired_difference
    difference = None if paired_difference is None else paired_difference.psnr
    return [
        str(point.label),
        point.kind,
        str(point.run_count),
        *metrics,
        format_statistics(point.byte_count, ",.0f") + (" stated" if point.is_size_stated else ""),
        format_statistics(point.kilobytes_per_frame, ",.2f"),
        _MISSING if rate is None else f"{rate:.2f}",
        format_statistics(difference, "+z.2f"),
        _MISSING
        if paired_difference is None
        else f"{paired_difference.better_share:.0%} of {paired_difference.pair_count}",
    ]


def format_statistics(statistics: Statistics | None, format_spec: str) -> str:
    """Format a mean, followed by its deviation if known."""
    if statistics is None:
        return _MISSING
    mean = format(statistics.mean, format_spec)
    return (
        mean
        if statistics.deviation is None
        else f"{mean} ± {statistics.deviation:{format_spec.strip('+')}}"
    )


def _mean_or_none(statistics: Statistics | None) -> float | None:
    return None if statistics is None else statistics.mean


def _deviation_or_none(statistics: Statistics | None) -> float | None:
    return None if statistics is None else statistics.deviation


def _format_bd_rate(deltas: BjontegaardDeltas) -> str:
    return _MISSING if deltas.rate is None else f"{deltas.rate:+z.1f} %"


def _point_as_json(point: OperatingPoint) -> dict[str, object]:
    return {
        "method": point.label.method,
        "point": point.label.point,
        "kind": point.kind,
        "runs": point.run_count,
        "quality": {name: _mean_or_none(statistics) for name, statistics in point.metrics.items()},
        "deviation": {
            name: _deviation_or_none(statistics) for name, statistics in point.metrics.items()
        },
        "bytes": _mean_or_none(point.byte_count),
        "bytes_stated": point.is_size_stated,
        "kb_per_frame": _mean_or_none(point.kilobytes_per_frame),
        "megabits_per_second": point.megabits_per_second,
        "paired": None
        if point.paired_difference is None
        else {
            "psnr": point.paired_difference.psnr.mean,
            "deviation": point.paired_difference.psnr.deviation,
            "better": point.paired_difference.better_share,
            "pairs": point.paired_difference.pair_count,
        },
    }


def _format_csv(lines: Sequence[dict[str, object]]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, _list_column_names(lines), lineterminator="\n")
    writer.writeheader()
    for line in lines:
        writer.writerow({name: _format_cell(value) for name, value in line.items()})
    return text.getvalue().encode()


def _list_column_names(lines: Iterable[dict[str, object]]) -> list[str]:
    return list(dict.fromkeys(name for line in lines for name in line))


def _format_cell(value: object) -> object:
    if isinstance(value, str):
        text = replace_unprintable(value)  # the writer does not quote a carriage return
        return f"'{text}" if text.startswith(_FORMULA_STARTS) else text
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value
