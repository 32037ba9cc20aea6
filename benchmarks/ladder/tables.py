"""The ladder as a table in Markdown."""

from collections.abc import Iterable

from quarc_ref.evaluation.camera_meter import Measures
from quarc_ref.inspection.stream_summary import KILOBYTE
from rate.tables import format_table
from studies import Row

_HEAD = (
    "ahead",
    "iterations",
    "free",
    "floats: training, all / moving",
    "held out, all / moving",
    "rounded: training, all / moving",
    "held out, all / moving",
    "Gaussians that change, die",
    "KB",
    "KB of SH rest",
)


def format_rows(rows: Iterable[Row]) -> str:
    """Return the table, with a line for each row."""
    return format_table(_HEAD, [_format_row(row) for row in rows])


def _format_row(row: Row) -> list[str]:
    changed, rest = row["changed"], row["rest_bytes"]
    return [
        f"{row['ahead']}",
        f"{row['iterations']}",
        row["title"],
        *(
            _format_figures(row[kind][group])
            for kind in ("floats", "rounded")
            for group in ("training", "held_out")
        ),
        f"{changed['any']:,}, {changed['deaths']:,}",
        f"{row['coded_bytes'] / KILOBYTE:.1f}",
        f"{rest / KILOBYTE:.1f}" if rest else "",
    ]


def _format_figures(figures: Measures) -> str:
    return " / ".join(
        "-" if (value := figures[name]) is None else f"{value:.2f}"
        for name in ("gain_psnr", "moving_gain_psnr")
    )
