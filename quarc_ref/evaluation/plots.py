"""Every plot and picture that is written to a file; the only importer of matplotlib."""

import io
from collections.abc import Sequence

import matplotlib.image
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from quarc_ref.evaluation.metrics import Picture
from quarc_ref.evaluation.stream_summary import KILOBYTE, KINDS, StreamSummary

_BLUE, _ORANGE, _GREEN, _GRAY = "#3b6ea8", "#d9822b", "#4f9d69", "#9aa3ad"
_KIND_COLORS = {"canonical": _GREEN, "motion": _BLUE, "births": _ORANGE, "overhead": _GRAY}
_DOTS_PER_INCH = 110


def plot_frames(summary: StreamSummary, psnr: Sequence[float]) -> bytes:
    """Return a PNG of the PSNR and the bytes of every frame."""
    figure, (above, below) = _figure(2)
    frames = [frame.frame for frame in summary.frames]
    above.plot(frames, psnr, color=_BLUE, marker="o", markersize=3)
    above.set_ylabel("PSNR, held out (dB)")
    floor = np.zeros(len(frames))
    for kind in ("motion", "births"):
        sizes = np.array([frame.coded_bytes[kind] / KILOBYTE for frame in summary.frames])
        below.bar(frames, sizes, bottom=floor, color=_KIND_COLORS[kind], label=kind)
        floor = floor + sizes
    framing = [_framing(frame.chunk_bytes, frame.coded_bytes) for frame in summary.frames]
    below.bar(frames, framing, bottom=floor, color=_GRAY, label="framing")
    below.set_ylabel("KB, canonical left out")
    below.set_xlabel("frame")
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    _legend_above(below)
    return _png(figure)


def plot_kinds(summary: StreamSummary) -> bytes:
    """Return a PNG of the bytes by kind, beside the zero-order estimate of the same symbols."""
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


def encode_picture(picture: Picture) -> bytes:
    """Return a PNG of a picture `[H, W, 3]` from 0 to 1."""
    buffer = io.BytesIO()
    levels = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)  # imsave would round down
    matplotlib.image.imsave(buffer, levels, format="png")
    return buffer.getvalue()


def _framing(chunk_bytes: int, coded_bytes: dict[str, int]) -> float:
    return 0.0 if coded_bytes["canonical"] else (chunk_bytes - sum(coded_bytes.values())) / KILOBYTE


def _figure(rows: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8, 2.6 * rows + 0.6), layout="constrained")
    first = figure.add_subplot(rows, 1, 1)
    axes = [first, *(figure.add_subplot(rows, 1, row, sharex=first) for row in range(2, rows + 1))]
    for each in axes:
        each.spines[["top", "right"]].set_visible(False)
        each.grid(axis="y", color="#e3e7ec", linewidth=0.8)
        each.set_axisbelow(True)
    return figure, axes


def _legend_above(axes: Axes) -> None:
    """Put the legend where no bar can be behind it."""
    axes.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    return buffer.getvalue()
