"""Formats the rows of a ladder as a Markdown table."""

from collections.abc import Iterable

from quarc_ref.evaluation.camera_meter import Measures
from quarc_ref.inspection.stream_summary import KILOBYTE
from rate.tables import format_table
from studies import Row

_HEADER = (
    "ahead",
    "iterations",
    "free",
    "PSNR before rounding, training views: all pixels / moving pixels",
    "PSNR before rounding, held-out cameras: all pixels / moving pixels",
    "PSNR after rounding, training views: all pixels / moving pixels",
    "PSNR after rounding, held-out cameras: all pixels / moving pixels",
    "Gaussians changed, deleted",
    "KB",
    "KB of SH rest",
)


def format_rows(rows: Iterable[Row]) -> str:
    """Return the rows as a Markdown table."""
    return format_table(_HEADER, [_format_row(row) for row in rows])


def _format_row(row: Row) -> list[str]:
    change_counts, sh_rest_bytes = row["changed"], row["rest_bytes"]
    return [
        f"{row['ahead']}",
        f"{row['iterations']}",
        row["title"],
        *(
            _format_figures(row[kind][group])
            for kind in ("floats", "rounded")
            for group in ("training", "held_out")
        ),
        f"{change_counts['any']:,}, {change_counts['deaths']:,}",
        f"{row['coded_bytes'] / KILOBYTE:.1f}",
        f"{sh_rest_bytes / KILOBYTE:.1f}" if sh_rest_bytes else "",
    ]


def _format_figures(figures: Measures) -> str:
    return " / ".join(
        "-" if (value := figures[name]) is None else f"{value:.2f}"
        for name in ("gain_psnr", "moving_gain_psnr")
    )
