"""Draws the plots and encodes the pictures of evaluations as PNG."""

import io
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import matplotlib.image
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, StrMethodFormatter

from quarc_ref.evaluation.metrics import Picture
from quarc_ref.inspection.stream_summary import KILOBYTE, KINDS, StreamSummary
from quarc_ref.wording import replace_unprintable

_BLUE, _ORANGE, _GREEN, _GRAY = "#3b6ea8", "#d9822b", "#4f9d69", "#9aa3ad"
_PURPLE, _TEAL = "#8361a8", "#2f8f8b"
_KIND_COLORS = {
    "canonical": _GREEN,
    "snapshots": _TEAL,
    "motion": _BLUE,
    "updates": _PURPLE,
    "births": _ORANGE,
    "overhead": _GRAY,
}
_CURVE_COLORS = (_BLUE, _ORANGE, _GREEN, _GRAY, _PURPLE, _TEAL)
_CURVE_STYLES = ("-", "--", ":")  # the next style is used when all colors have been used
# in characters: maximum length of a label and of a legend line; width of the mark before a label
_MAX_LABEL_LENGTH, _MAX_LEGEND_LENGTH, _MARK_WIDTH = 40, 90, 6
_DOTS_PER_INCH = 110
_MIN_LOG_AXIS_RATIO = 6  # the axis is logarithmic if highest rate / lowest rate exceeds this


@dataclass(frozen=True, slots=True)
class Curve:
    """The points of a curve.

    Attributes:
        x: Their x coordinates.
        y: Their y coordinates.
        y_deviations: Lengths of the error bars above and below the points; None for a point
            without bars, and empty if no point has any.
    """

    x: Sequence[float]
    y: Sequence[float]
    y_deviations: Sequence[float | None] = ()


def plot_frames(summary: StreamSummary, psnr: Curve) -> bytes:
    """Return a PNG plot of the PSNR and the size of every frame."""
    figure, (top_axes, bottom_axes) = _make_figure(2)
    frames = [frame.frame for frame in summary.frames]
    top_axes.plot(psnr.x, psnr.y, color=_BLUE, marker="o", markersize=3)
    top_axes.set_ylabel("PSNR of held-out views (dB)")
    stack_tops = np.zeros(len(frames))
    for kind in ("motion", "updates", "births"):
        sizes = np.array([frame.coded_bytes[kind] / KILOBYTE for frame in summary.frames])
        bottom_axes.bar(frames, sizes, bottom=stack_tops, color=_KIND_COLORS[kind], label=kind)
        stack_tops = stack_tops + sizes
    overhead_sizes = [
        _compute_overhead_kilobytes(frame.chunk_bytes, frame.coded_bytes)
        for frame in summary.frames
    ]
    bottom_axes.bar(frames, overhead_sizes, bottom=stack_tops, color=_GRAY, label="overhead")
    bottom_axes.set_ylabel("KB, without keyframes")
    bottom_axes.set_xlabel("frame")
    bottom_axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _place_legend_above(bottom_axes)
    return _encode_png(figure)


def plot_bytes_by_kind(summary: StreamSummary) -> bytes:
    """Return a PNG plot of the coded size and the zero-order estimate of each kind of data."""
    figure, (axes,) = _make_figure(1)
    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    kinds = [*KINDS, "overhead"]
    positions = np.arange(len(kinds))
    coded_bars = axes.bar(
        positions - 0.2,
        [coded[kind] / KILOBYTE for kind in kinds],
        width=0.4,
        color=[_KIND_COLORS[kind] for kind in kinds],
        label="in the file",
    )
    estimate_bars = axes.bar(
        positions[: len(KINDS)] + 0.2,
        [estimate[kind] / KILOBYTE for kind in KINDS],
        width=0.4,
        color="none",
        edgecolor=_GRAY,
        hatch="///",
        label="zero-order estimate",
    )
    axes.bar_label(coded_bars, fmt="%.1f", fontsize=8)
    axes.bar_label(estimate_bars, fmt="%.1f", fontsize=8)
    axes.set_xticks(positions, kinds)
    axes.set_xlim(-0.6, len(kinds) - 0.4)
    axes.set_ylabel("KB, whole stream")
    _place_legend_above(axes)
    return _encode_png(figure)


def plot_coders(panels: Mapping[str, Mapping[str, float]]) -> bytes:
    """Return a PNG plot of the sizes to which different coders compress the same symbols.

    Args:
        panels: `{label of the y axis: {coder: size}}`; a panel may omit coders that do not
            apply to it.
    """
    figure, axes_list = _make_figure(len(panels))
    coders = list(dict.fromkeys(coder for sizes in panels.values() for coder in sizes))
    for axes, (label, sizes) in zip(axes_list, panels.items(), strict=True):
        bars = axes.bar(
            [coders.index(coder) for coder in sizes], list(sizes.values()), color=_BLUE, width=0.6
        )
        axes.bar_label(bars, fmt="%.3g", fontsize=8)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=axes is axes_list[-1])
    axes_list[-1].set_xticks(range(len(coders)), coders, rotation=30, ha="right", fontsize=8)
    return _encode_png(figure)


def plot_number_groups(panels: Mapping[str, Mapping[str, Sequence[float]]]) -> bytes:
    """Return a PNG plot with a dot for each number and a bar for the mean of each group.

    Args:
        panels: `{label of the y axis: {name of the group: numbers}}` with the same names in every
            panel.
    """
    figure, axes_list = _make_figure(len(panels))
    for axes, (label, groups) in zip(axes_list, panels.items(), strict=True):
        for position, numbers in enumerate(groups.values()):
            axes.plot([position] * len(numbers), numbers, color=_BLUE, marker="o", linestyle="")
            if numbers:
                axes.hlines(np.mean(numbers), position - 0.25, position + 0.25, color=_ORANGE)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=axes is axes_list[-1])
    names = list(next(iter(panels.values())))
    axes_list[-1].set_xticks(range(len(names)), names, rotation=30, ha="right", fontsize=8)
    return _encode_png(figure)


def plot_rate_distortion(
    points: Sequence[tuple[float, float, str]], hull: Sequence[tuple[float, float]]
) -> bytes:
    """Return a PNG plot of quality against rate, with the upper hull.

    Args:
        points: KB per frame, PSNR in dB and the changed setting of each point; the first point has
            the default settings.
        hull: KB per frame and PSNR in dB of the points on the hull, in ascending order of rate.
    """
    figure, (axes,) = _make_figure(1, height=5)
    axes.plot(*zip(*hull, strict=True), color=_GRAY, linewidth=1, label="upper hull")
    (default, *other_points) = points
    axes.plot(*default[:2], color=_ORANGE, marker="D", linestyle="", zorder=3, label="default")
    for rate, quality, change in other_points:
        axes.plot(rate, quality, color=_BLUE, marker="o", markersize=4)
        axes.annotate(
            change,
            (rate, quality),
            (4, -8),
            textcoords="offset points",
            color="#4a545e",
            fontsize=7,
        )
    axes.set_xlabel("KB per frame, with the canonical frame spread over 300 frames")
    axes.set_ylabel("PSNR of held-out views (dB)")
    _place_legend_above(axes)
    return _encode_png(figure)


def plot_curves(
    panels: Mapping[str, Mapping[str, Curve]], axis_label: str, *, is_log2: bool = False
) -> bytes:
    """Return a PNG plot of curves in vertically stacked panels with a common x axis.

    Args:
        panels: `{label of the panel: {name of the curve: curve}}`; the name of a single
            curve may be empty.
        axis_label: Label of the common x axis.
        is_log2: Whether the x axis is logarithmic with base 2.
    """
    figure, axes_list = _make_figure(len(panels))
    for axes, (label, curves) in zip(axes_list, panels.items(), strict=True):
        _draw_curves(axes, curves, marker_size=3)
        axes.set_ylabel(label)
        if is_log2:
            axes.set_xscale("log", base=2)
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        else:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.tick_params(labelbottom=axes is axes_list[-1])
    axes_list[-1].set_xlabel(axis_label)
    if len(next(iter(panels.values()))) > 1:
        _place_legend_above(axes_list[0])
    return _encode_png(figure)


def plot_rates(panels: Mapping[str, Mapping[str, Curve]], axis_label: str) -> bytes:
    """Return a PNG plot of quality against rate, with one panel per metric.

    Args:
        panels: `{label of the panel: {name of the curve: curve}}` with at least two points in
            total.
        axis_label: Label of the rate axis, which is logarithmic for a wide range of rates.
    """
    figure, axes_list = _make_figure(len(panels), height=3.4)
    for axes, (label, curves) in zip(axes_list, panels.items(), strict=True):
        _draw_curves(axes, curves, marker_size=4)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=axes is axes_list[-1])
    rates = [rate for curves in panels.values() for curve in curves.values() for rate in curve.x]
    if max(rates) > _MIN_LOG_AXIS_RATIO * min(rates) > 0:
        axes_list[-1].set_xscale("log")
        axes_list[-1].xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes_list[-1].xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes_list[-1].minorticks_off()
    axes_list[-1].set_xlabel(axis_label)
    _place_legend_above(axes_list[0])
    return _encode_png(figure)


def encode_picture(picture: Picture) -> bytes:
    """Encode a picture `[H, W, 3]` from 0 to 1 as PNG."""
    buffer = io.BytesIO()
    levels = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)  # because imsave rounds down
    matplotlib.image.imsave(buffer, levels, format="png")
    return buffer.getvalue()


def _compute_overhead_kilobytes(chunk_bytes: int, coded_bytes: dict[str, int]) -> float:
    return (
        0.0
        if coded_bytes["canonical"] or coded_bytes["snapshots"]
        else (chunk_bytes - sum(coded_bytes.values())) / KILOBYTE
    )


def _make_figure(row_count: int, height: float = 2.6) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8, height * row_count + 0.6), layout="constrained")
    first_axes = figure.add_subplot(row_count, 1, 1)
    axes_list = [
        first_axes,
        *(
            figure.add_subplot(row_count, 1, row, sharex=first_axes)
            for row in range(2, row_count + 1)
        ),
    ]
    for axes in axes_list:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="#e3e7ec", linewidth=0.8)
        axes.set_axisbelow(True)
    return figure, axes_list


def _draw_curves(axes: Axes, curves: Mapping[str, Curve], marker_size: int) -> None:
    """Draw curves that all look different, up to 18 of them."""
    looks = itertools.cycle(itertools.product(_CURVE_STYLES, _CURVE_COLORS))
    for (name, curve), (style, color) in zip(curves.items(), looks, strict=False):
        (line,) = axes.plot(curve.x, curve.y, marker="o", markersize=marker_size)
        line.set(color=color, linestyle=style, label=_escape_label(name))
        if curve.y_deviations:
            lengths = [math.nan if length is None else length for length in curve.y_deviations]
            axes.errorbar(curve.x, curve.y, lengths, fmt="none", color=color, capsize=marker_size)


def _escape_label(name: str) -> str:
    """Return a label that matplotlib shows as it is.

    matplotlib omits labels that start with an underscore, formats text between dollar signs, and
    fails at bytes of a file name that are no valid UTF-8. Control characters are replaced, too.
    """
    escaped_name = replace_unprintable(name).replace("$", r"\$")
    return f" {escaped_name}" if name.startswith("_") else escaped_name


def _place_legend_above(axes: Axes) -> None:
    """Place the legend above the plot, at most as wide as the figure.

    Long labels, which may be paths, are truncated at the start.
    """
    handles, names = axes.get_legend_handles_labels()
    names = [
        name if len(name) <= _MAX_LABEL_LENGTH else "\u2026" + name[1 - _MAX_LABEL_LENGTH :]
        for name in names
    ]
    column_count = max(1, min(3, _MAX_LEGEND_LENGTH // (max(map(len, names)) + _MARK_WIDTH)))
    axes.legend(
        handles,
        names,
        frameon=False,
        ncols=column_count,
        loc="lower right",
        bbox_to_anchor=(1, 1),
        borderaxespad=0,
    )


def _encode_png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    return buffer.getvalue()
