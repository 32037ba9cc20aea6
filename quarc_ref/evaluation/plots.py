"""Draws all plots and pictures for files; the only module that imports matplotlib."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

import matplotlib.image
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, StrMethodFormatter

from quarc_ref.evaluation.metrics import Picture
from quarc_ref.inspection.stream_summary import KILOBYTE, KINDS, StreamSummary

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
# maximum characters of a label and a legend; width of the mark before a label
_LABEL, _LEGEND, _MARK = 40, 90, 6
_DOTS_PER_INCH = 110
_MANY_TIMES = 6  # ratio of the highest rate to the lowest


@dataclass(frozen=True, slots=True)
class Curve:
    """Positions along an axis and values."""

    x: Sequence[float]
    y: Sequence[float]


def plot_frames(summary: StreamSummary, psnr: Curve) -> bytes:
    """Plot the PSNR and the bytes of every frame as PNG."""
    figure, (above, below) = _figure(2)
    frames = [frame.frame for frame in summary.frames]
    above.plot(psnr.x, psnr.y, color=_BLUE, marker="o", markersize=3)
    above.set_ylabel("PSNR, held out (dB)")
    floor = np.zeros(len(frames))
    for kind in ("motion", "updates", "births"):
        sizes = np.array([frame.coded_bytes[kind] / KILOBYTE for frame in summary.frames])
        below.bar(frames, sizes, bottom=floor, color=_KIND_COLORS[kind], label=kind)
        floor = floor + sizes
    framing = [_framing(frame.chunk_bytes, frame.coded_bytes) for frame in summary.frames]
    below.bar(frames, framing, bottom=floor, color=_GRAY, label="overhead")
    below.set_ylabel("KB, without canonical frames")
    below.set_xlabel("frame")
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    _legend_above(below)
    return _png(figure)


def plot_kinds(summary: StreamSummary) -> bytes:
    """Plot the bytes by kind, next to the zero-order estimate of the same symbols, as PNG."""
    figure, (axes,) = _figure(1)
    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    kinds = [*KINDS, "overhead"]
    places = np.arange(len(kinds))
    real = axes.bar(
        places - 0.2,
        [coded[kind] / KILOBYTE for kind in kinds],
        width=0.4,
        color=[_KIND_COLORS[kind] for kind in kinds],
        label="in the file",
    )
    ideal = axes.bar(
        places[: len(KINDS)] + 0.2,
        [estimate[kind] / KILOBYTE for kind in KINDS],
        width=0.4,
        color="none",
        edgecolor=_GRAY,
        hatch="///",
        label="zero-order estimate",
    )
    axes.bar_label(real, fmt="%.1f", fontsize=8)
    axes.bar_label(ideal, fmt="%.1f", fontsize=8)
    axes.set_xticks(places, kinds)
    axes.set_xlim(-0.6, len(kinds) - 0.4)
    axes.set_ylabel("KB, whole stream")
    _legend_above(axes)
    return _png(figure)


def plot_coders(panels: Mapping[str, Mapping[str, float]]) -> bytes:
    """Plot the sizes that coders need for the same symbols as PNG.

    Args:
        panels: `{label of the axis: {coder: size}}`; a panel omits coders that do not
            code its kind.
    """
    figure, rows = _figure(len(panels))
    coders = list(dict.fromkeys(coder for sizes in panels.values() for coder in sizes))
    for axes, (label, sizes) in zip(rows, panels.items(), strict=True):
        bars = axes.bar(
            [coders.index(coder) for coder in sizes], list(sizes.values()), color=_BLUE, width=0.6
        )
        axes.bar_label(bars, fmt="%.3g", fontsize=8)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=axes is rows[-1])
    rows[-1].set_xticks(range(len(coders)), coders, rotation=30, ha="right", fontsize=8)
    return _png(figure)


def plot_spreads(panels: Mapping[str, Mapping[str, Sequence[float]]]) -> bytes:
    """Plot the spread of numbers as PNG: a dot for each number, a bar for their mean.

    Args:
        panels: `{label of the axis: {name: numbers}}` with the same names in every panel.
    """
    figure, rows = _figure(len(panels))
    for axes, (label, groups) in zip(rows, panels.items(), strict=True):
        for place, numbers in enumerate(groups.values()):
            axes.plot([place] * len(numbers), numbers, color=_BLUE, marker="o", linestyle="")
            if numbers:
                axes.hlines(np.mean(numbers), place - 0.25, place + 0.25, color=_ORANGE)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=axes is rows[-1])
    names = list(next(iter(panels.values())))
    rows[-1].set_xticks(range(len(names)), names, rotation=30, ha="right", fontsize=8)
    return _png(figure)


def plot_rate_distortion(
    points: Sequence[tuple[float, float, str]], hull: Sequence[tuple[float, float]]
) -> bytes:
    """Plot quality against rate, with the upper hull, as PNG.

    Args:
        points: KB per frame, dB and the changed setting of each point; the default first.
        hull: KB per frame and dB of the points on the hull, from the left.
    """
    figure, (axes,) = _figure(1, height=5)
    axes.plot(*zip(*hull, strict=True), color=_GRAY, linewidth=1, label="upper hull")
    (default, *others) = points
    axes.plot(*default[:2], color=_ORANGE, marker="D", linestyle="", zorder=3, label="default")
    for rate, quality, change in others:
        axes.plot(rate, quality, color=_BLUE, marker="o", markersize=4)
        axes.annotate(
            change,
            (rate, quality),
            (4, -8),
            textcoords="offset points",
            color="#4a545e",
            fontsize=7,
        )
    axes.set_xlabel("KB per frame, canonical frame spread over 300")
    axes.set_ylabel("PSNR, held out (dB)")
    _legend_above(axes)
    return _png(figure)


def plot_curves(
    panels: Mapping[str, Mapping[str, Curve]], axis: str, *, doublings: bool = False
) -> bytes:
    """Plot curves over one axis in vertically stacked panels as PNG.

    Args:
        panels: `{label of the panel: {name of the curve: curve}}`; a single curve
            needs no name.
        axis: Label of the common axis.
        doublings: Whether the axis is logarithmic.
    """
    figure, rows = _figure(len(panels))
    for axes, (label, curves) in zip(rows, panels.items(), strict=True):
        for (name, curve), color in zip(curves.items(), cycle(_CURVE_COLORS)):
            axes.plot(curve.x, curve.y, color=color, marker="o", markersize=3, label=name)
        axes.set_ylabel(label)
        if doublings:
            axes.set_xscale("log", base=2)
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        else:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.tick_params(labelbottom=axes is rows[-1])
    rows[-1].set_xlabel(axis)
    if len(next(iter(panels.values()))) > 1:
        _legend_above(rows[0])
    return _png(figure)


def plot_rates(panels: Mapping[str, Mapping[str, Curve]], axis: str) -> bytes:
    """Plot quality against rate, with one panel per metric, as PNG.

    Args:
        panels: `{label of the panel: {name of the curve: curve}}` with at least two points.
        axis: Label of the rate axis, which is logarithmic if rates differ much.
    """
    figure, rows = _figure(len(panels), height=3.4)
    for axes, (label, curves) in zip(rows, panels.items(), strict=True):
        for (name, curve), color in zip(curves.items(), cycle(_CURVE_COLORS)):
            axes.plot(curve.x, curve.y, color=color, marker="o", markersize=4, label=name)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=axes is rows[-1])
    rates = [rate for curves in panels.values() for curve in curves.values() for rate in curve.x]
    if max(rates) > _MANY_TIMES * min(rates) > 0:
        rows[-1].set_xscale("log")
        rows[-1].xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        rows[-1].xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        rows[-1].minorticks_off()
    rows[-1].set_xlabel(axis)
    _legend_above(rows[0])
    return _png(figure)


def plot_decode_speed(lines: Mapping[str, Sequence[tuple[int, float]]]) -> bytes:
    """Plot the time of a frame against the number of Gaussians as PNG.

    Args:
        lines: `{label: (Gaussians, milliseconds)}` in ascending order.
    """
    figure, (axes,) = _figure(1, height=4)
    for color, (label, points) in zip((_BLUE, _ORANGE, _GREEN), lines.items(), strict=False):
        axes.loglog(*zip(*points, strict=True), color=color, marker="o", label=label)
    axes.axhline(1000 / 30, color=_GRAY, linestyle="--", linewidth=1, label="30 frames per second")
    axes.set_xlabel("Gaussians")
    axes.set_ylabel("ms per frame")
    counts = sorted({count for points in lines.values() for count, _ in points})
    axes.set_xticks(counts, [f"{count:,}" for count in counts])
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.minorticks_off()
    _legend_above(axes)
    return _png(figure)


def encode_picture(picture: Picture) -> bytes:
    """Encode a picture `[H, W, 3]` from 0 to 1 as PNG."""
    buffer = io.BytesIO()
    levels = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)  # because imsave rounds down
    matplotlib.image.imsave(buffer, levels, format="png")
    return buffer.getvalue()


def _framing(chunk_bytes: int, coded_bytes: dict[str, int]) -> float:
    return (
        0.0
        if coded_bytes["canonical"] or coded_bytes["snapshots"]
        else (chunk_bytes - sum(coded_bytes.values())) / KILOBYTE
    )


def _figure(rows: int, height: float = 2.6) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8, height * rows + 0.6), layout="constrained")
    first = figure.add_subplot(rows, 1, 1)
    axes = [first, *(figure.add_subplot(rows, 1, row, sharex=first) for row in range(2, rows + 1))]
    for each in axes:
        each.spines[["top", "right"]].set_visible(False)
        each.grid(axis="y", color="#e3e7ec", linewidth=0.8)
        each.set_axisbelow(True)
    return figure, axes


def _legend_above(axes: Axes) -> None:
    """Place the legend above the bars, at most as wide as the figure.

    Only the ends of long labels, which may be paths, are shown.
    """
    handles, names = axes.get_legend_handles_labels()
    names = [name if len(name) <= _LABEL else "\u2026" + name[1 - _LABEL :] for name in names]
    columns = max(1, min(3, _LEGEND // (max(map(len, names)) + _MARK)))
    axes.legend(
        handles,
        names,
        frameon=False,
        ncols=columns,
        loc="lower right",
        bbox_to_anchor=(1, 1),
        borderaxespad=0,
    )


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    return buffer.getvalue()
