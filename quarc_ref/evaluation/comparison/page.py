"""Writes the HTML page of a comparison: tables, plots, and a slider between two pictures."""

import html
import json
from collections.abc import Iterable, Sequence
from importlib import resources
from pathlib import Path

from quarc_ref.evaluation.comparison.measure import ComparedView, Comparison
from quarc_ref.evaluation.comparison.summary import OperatingPoint, Summary
from quarc_ref.evaluation.comparison.tables import (
    format_delta_rows,
    format_point_rows,
    format_points_csv,
    format_views_csv,
    list_delta_headings,
    list_point_headings,
    list_remarks,
)
from quarc_ref.evaluation.pages import (
    embed_png,
    fill_page,
    format_lines,
    format_table,
    format_texts,
)
from quarc_ref.evaluation.plots import Curve, encode_picture, plot_curves, plot_rates
from quarc_ref.files import OutputFolder
from quarc_ref.wording import format_count

_TRUTH_LABEL = "truth"


def write_comparison(comparison: Comparison, summary: Summary, folder: OutputFolder) -> Path:
    """Write the page, its pictures and CSV tables; return the path of the page.

    Args:
        comparison: Measurements of all entries.
        summary: Summary of the same comparison.
        folder: Output folder from `quarc_ref.files.written_folder`.
    """
    folder.write("points.csv", format_points_csv(summary))
    folder.write("views.csv", format_views_csv(comparison))
    picture_names = [
        _write_pictures(view, number, folder) for number, view in enumerate(comparison.shown_views)
    ]
    return folder.write("index.html", _compose_page(comparison, summary, picture_names))


def _write_pictures(view: ComparedView, number: int, folder: OutputFolder) -> list[str]:
    """Write the truth and every entry's picture of a view; return the names of the files."""
    names = []
    for index, picture in enumerate([view.truth, *view.pictures]):
        name = f"view{number}_{index}.png"
        names.append(folder.write(name, encode_picture(picture)).name)
    return names


def _compose_page(
    comparison: Comparison, summary: Summary, picture_names: Sequence[Sequence[str]]
) -> bytes:
    template = resources.files(__package__).joinpath("compare.html").read_text("utf-8")
    labels = _name_entries(comparison)
    views = [
        {
            "name": f"{view.camera}, frame {view.frame}",
            "files": list(file_names),
            "psnr": [None, *(round(psnr, 2) for psnr in view.psnr)],
        }
        for view, file_names in zip(comparison.shown_views, picture_names, strict=True)
    ]
    plot_figures = _plot_rates(summary) + _plot_frames(comparison, labels)
    parts = {
        "title": html.escape(", ".join(_list_methods(summary))),
        "subtitle": html.escape(_describe_comparison(comparison)),
        "data": json.dumps({"entries": [_TRUTH_LABEL, *labels], "views": views}).replace(
            "<", "\\u003c"
        ),
        "points": format_table(list_point_headings(summary), format_point_rows(summary)),
        "remarks": "".join(f"<p>{html.escape(remark)}.</p>" for remark in list_remarks(comparison)),
        "deltas": _compose_deltas(summary),
        "plots": "".join(plot_figures),
        "metrics": format_texts(comparison.variants.values()),
        "protocol": format_lines(comparison.protocol.as_texts()),
    }
    return fill_page(template, parts)


def _list_methods(summary: Summary) -> list[str]:
    return list(dict.fromkeys(point.label.method for point in summary.points))


def _name_entries(comparison: Comparison) -> list[str]:
    """Return a name for every entry; runs of the same operating point are numbered."""
    labels = [str(entry.label) for entry in comparison.measured_entries]
    return [
        label if labels.count(label) == 1 else f"{label}, run {labels[:index].count(label) + 1}"
        for index, label in enumerate(labels)
    ]


def _describe_comparison(comparison: Comparison) -> str:
    frames, cameras = comparison.frames, comparison.cameras
    frame_range = f"{frames[0]} to {frames[-1]}" if len(frames) > 1 else f"number {frames[0]}"
    view_text = f"{format_count(len(frames), 'frame')} ({frame_range}) of {', '.join(cameras)}"
    return f"Measured against {comparison.truth_description}, on {view_text}. 1 KB is 1024 bytes."


def _compose_deltas(summary: Summary) -> str:
    if not summary.deltas:
        return ""
    table = format_table(list_delta_headings(summary), format_delta_rows(summary))
    return f"<h2>Bjøntegaard deltas</h2><div class='wide'>{table}</div>"


def _plot_rates(summary: Summary) -> list[str]:
    """Return the HTML of a plot of quality against rate; empty for fewer than two known rates."""
    points_with_rate = [point for point in summary.points if point.kilobytes_per_frame is not None]
    if len(points_with_rate) < _MIN_POINTS:
        return []
    metrics = [("PSNR (dB)", "psnr"), ("SSIM", "ssim"), ("LPIPS", "lpips")]
    panels = {
        label: dict(_build_curves(points_with_rate, name))
        for label, name in metrics
        if any(point.metrics.get(name) for point in points_with_rate)
    }
    picture = plot_rates(panels, "KB per frame")
    return [_format_plot(picture, "Quality against bytes per frame")]


def _build_curves(points: Iterable[OperatingPoint], metric: str) -> Iterable[tuple[str, Curve]]:
    points_by_method: dict[str, list[tuple[float, float, float | None]]] = {}
    for point in points:
        quality, rate = point.metrics.get(metric), point.kilobytes_per_frame
        if quality is not None and rate is not None:
            point_of_curve = (rate.mean, quality.mean, quality.deviation)
            points_by_method.setdefault(point.label.method, []).append(point_of_curve)
    for method, method_points in points_by_method.items():
        yield method, Curve(*zip(*sorted(method_points, key=lambda each: each[:2]), strict=True))


def _plot_frames(comparison: Comparison, labels: Sequence[str]) -> list[str]:
    """Return the HTML of a plot of PSNR per frame; empty for fewer than two frames."""
    if len(comparison.frames) < _MIN_POINTS:
        return []
    curves = {
        label: Curve(
            comparison.frames,
            [frame_metrics["psnr"] or 0.0 for frame_metrics in entry.quality.by_frame()],
        )
        for label, entry in zip(labels, comparison.measured_entries, strict=True)
    }
    picture = plot_curves({"PSNR (dB)": curves}, "frame")
    return [_format_plot(picture, "PSNR of every frame")]


def _format_plot(picture: bytes, caption: str) -> str:
    return f'<figure class="plot"><img alt="{caption}" src="{embed_png(picture)}"></figure>'


_MIN_POINTS = 2
