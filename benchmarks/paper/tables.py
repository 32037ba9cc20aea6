"""Formats rows as tables: CSV, HTML and Markdown."""

import html
from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import fmean
from typing import Any

from rate.tables import format_csv
from studies import Row

Column = tuple[str, Callable[[Row], Any], str]

_STAGES = ("anchors", "motion", "placement", "births", "commit")

# Heading, value and format of each column.
COLUMNS: tuple[Column, ...] = (
    ("PSNR", lambda row: row["quality"]["psnr"], ".2f"),
    ("first PSNR", lambda row: row["quality"]["psnr_first"], ".2f"),
    ("worst PSNR", lambda row: row["quality"]["psnr_worst"], ".2f"),
    ("moving PSNR", lambda row: row["quality"]["psnr_moving"], ".2f"),
    ("slope, dB / 100 frames", lambda row: row["quality"]["psnr_slope"], ".1f"),
    ("SSIM", lambda row: row["quality"]["ssim"], ".4f"),
    ("LPIPS", lambda row: row["quality"]["lpips"], ".4f"),
    ("KB / frame", lambda row: row["bytes"]["kb_per_frame"], ".2f"),
    ("motion KB / frame", lambda row: row["bytes"]["motion_kb_per_frame"], ".3f"),
    ("updates KB / frame", lambda row: row["bytes"].get("updates_kb_per_frame"), ".3f"),
    ("births KB / frame", lambda row: row["bytes"]["births_kb_per_frame"], ".3f"),
    ("canonical KB", lambda row: row["bytes"]["canonical_kb"], ".1f"),
    ("overhead KB", lambda row: row["bytes"]["overhead_kb"], ".1f"),
    ("estimate, KB / frame", lambda row: _get_estimate(row), ".2f"),
    ("births / frame", lambda row: fmean(row["births"][1:] or [0]), ".0f"),
    ("Gaussians", lambda row: row["gaussians"][-1], ",d"),
    ("s / frame", lambda row: row["seconds"]["frame"], ".2f"),
    ("s for frame 0", lambda row: row["seconds"]["canonical"], ".1f"),
)
_OPTIONAL_HEADINGS = ("LPIPS",)


def format_cells(row: Row, columns: Sequence[Column]) -> list[str]:
    """Return the cells of a row as text; a cell without a value is empty."""
    values = [(get_value(row), format_spec) for _, get_value, format_spec in columns]
    return ["" if value is None else format(value, format_spec) for value, format_spec in values]


def choose_columns(rows: Iterable[Row]) -> list[Column]:
    """Return all columns, except optional columns for which no row has a value."""
    row_list = list(rows)
    return [
        column
        for column in COLUMNS
        if column[0] not in _OPTIONAL_HEADINGS
        or any(column[1](row) is not None for row in row_list)
    ]


def format_study_csv(rows: Sequence[tuple[str, Row]]) -> bytes:
    """Return CSV with a line for each row: the name of its experiment, and all its values."""
    lines = [{"experiment": experiment, **flatten_row(row)} for experiment, row in rows]
    return format_csv(lines)


def flatten_row(row: Row) -> dict[str, Any]:
    """Return the values of a row by name; values per frame are replaced by their means."""
    values = {name: row[name] for name in ("name", "title", "label", "floats", "rebinds", "frames")}
    for group in ("quality", "bytes", "seconds"):
        values |= {f"{group}_{name}": value for name, value in row[group].items()}
    values["births_per_frame"] = fmean(row["births"][1:] or [0])
    values["deaths_per_frame"] = fmean(row["deaths"][1:] or [0])
    values |= {"gaussians": row["gaussians"][-1], "anchors": row["anchors"], "seed": row["seed"]}
    values["renderer"] = row["renderer"]["training"]
    values |= {f"metric_{name}": text for name, text in row["protocol"]["metrics"].items()}
    values["changes"] = " ".join(f"{name}={value}" for name, value in row["changes"].items())
    return values


def format_html(rows: Sequence[Row]) -> str:
    """Return the rows as an HTML table."""
    columns = choose_columns(rows)
    header = "".join(f"<th>{html.escape(name)}</th>" for name in ("", *(c[0] for c in columns)))
    lines = []
    for row in rows:
        cells = [html.escape(row["label"]), *format_cells(row, columns)]
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return f"<table><tr>{header}</tr>{''.join(lines)}</table>"


def format_stages(rows: Sequence[Row]) -> str:
    """Return an HTML table with the seconds per frame that each stage takes."""
    header = "".join(f"<th>{name}</th>" for name in ("", *_STAGES, "frame", "frame 0"))
    lines = []
    for row in rows:
        seconds: Mapping[str, float] = row["seconds"]
        numbers = [f"{seconds[name]:.3f}" for name in (*_STAGES, "frame")]
        cells = [html.escape(row["name"]), *numbers, f"{seconds['canonical']:.1f}"]
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return f"<table><tr>{header}</tr>{''.join(lines)}</table>"


def format_markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    columns = choose_columns(rows)
    lines = [["", *(column[0] for column in columns)], ["---"] * (len(columns) + 1)]
    lines += [[row["label"], *format_cells(row, columns)] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _get_estimate(row: Row) -> float | None:
    """Return the estimated KB per later frame; None for a row of an earlier version."""
    sizes = row["bytes"]
    if "updates_estimate_kb_per_frame" not in sizes:
        return None
    kinds = ("motion", "updates", "births")
    total: float = sum(sizes[f"{kind}_estimate_kb_per_frame"] for kind in kinds)
    return total
