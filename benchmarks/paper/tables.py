"""Formats rows as tables: CSV, HTML and Markdown."""

import csv
import html
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import fmean
from typing import Any

from studies import Row

Column = tuple[str, Callable[[Row], Any], str]

_STAGES = ("anchors", "motion", "placement", "births", "commit")

# Heading, value, format.
COLUMNS: tuple[Column, ...] = (
    ("PSNR", lambda row: row["quality"]["psnr"], ".2f"),
    ("first", lambda row: row["quality"]["psnr_first"], ".2f"),
    ("worst", lambda row: row["quality"]["psnr_worst"], ".2f"),
    ("moving", lambda row: row["quality"]["psnr_moving"], ".2f"),
    ("dB / 100", lambda row: row["quality"]["psnr_slope"], ".1f"),
    ("SSIM", lambda row: row["quality"]["ssim"], ".4f"),
    ("LPIPS", lambda row: row["quality"]["lpips"], ".4f"),
    ("KB / frame", lambda row: row["bytes"]["kb_per_frame"], ".2f"),
    ("motion", lambda row: row["bytes"]["motion_kb_per_frame"], ".3f"),
    ("births", lambda row: row["bytes"]["births_kb_per_frame"], ".3f"),
    ("canonical KB", lambda row: row["bytes"]["canonical_kb"], ".1f"),
    ("overhead KB", lambda row: row["bytes"]["overhead_kb"], ".1f"),
    ("estimate", lambda row: _estimate(row), ".2f"),
    ("births, n", lambda row: fmean(row["births"][1:] or [0]), ".0f"),
    ("Gaussians", lambda row: row["gaussians"][-1], ",d"),
    ("s / frame", lambda row: row["seconds"]["frame"], ".2f"),
    ("s canonical", lambda row: row["seconds"]["canonical"], ".1f"),
)
_OPTIONAL = ("LPIPS",)


def format_cells(row: Row, columns: Sequence[Column]) -> list[str]:
    """Return the cells of a row as text; empty without a number."""
    values = [(get(row), how) for _, get, how in columns]
    return ["" if value is None else format(value, how) for value, how in values]


def choose_columns(rows: Iterable[Row]) -> list[Column]:
    """Return the columns for which any row has a number, and all that are not optional."""
    listed = list(rows)
    return [
        column
        for column in COLUMNS
        if column[0] not in _OPTIONAL or any(column[1](row) is not None for row in listed)
    ]


def write_csv(rows: Sequence[tuple[str, Row]]) -> bytes:
    """Return a line with every number of each row, under `experiment` and the row's own names."""
    lines = [{"experiment": experiment, **flatten(row)} for experiment, row in rows]
    names = list(dict.fromkeys(name for line in lines for name in line))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue().encode()


def flatten(row: Row) -> dict[str, Any]:
    """Return the numbers of a row by name; of lists the mean, without values per frame."""
    flat = {name: row[name] for name in ("name", "title", "label", "floats", "rebinds", "frames")}
    for group in ("quality", "bytes", "seconds"):
        flat |= {f"{group}_{name}": value for name, value in row[group].items()}
    flat["births_per_frame"] = fmean(row["births"][1:] or [0])
    flat["deaths_per_frame"] = fmean(row["deaths"][1:] or [0])
    flat |= {"gaussians": row["gaussians"][-1], "anchors": row["anchors"], "seed": row["seed"]}
    flat["renderer"] = row["renderer"]["training"]
    flat |= {f"metric_{name}": text for name, text in row["protocol"]["metrics"].items()}
    flat["changes"] = " ".join(f"{name}={value}" for name, value in row["changes"].items())
    return flat


def format_html(rows: Sequence[Row]) -> str:
    """Return a table with a line for each row."""
    columns = choose_columns(rows)
    head = "".join(f"<th>{html.escape(name)}</th>" for name in ("", *(c[0] for c in columns)))
    lines = []
    for row in rows:
        cells = [html.escape(row["label"]), *format_cells(row, columns)]
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return f"<table><tr>{head}</tr>{''.join(lines)}</table>"


def format_stages(rows: Sequence[Row]) -> str:
    """Return the table of seconds per frame by stage."""
    head = "".join(f"<th>{name}</th>" for name in ("", *_STAGES, "frame", "canonical, once"))
    lines = []
    for row in rows:
        seconds: Mapping[str, float] = row["seconds"]
        numbers = [f"{seconds[name]:.3f}" for name in (*_STAGES, "frame")]
        cells = [html.escape(row["name"]), *numbers, f"{seconds['canonical']:.1f}"]
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return f"<table><tr>{head}</tr>{''.join(lines)}</table>"


def format_markdown(rows: Sequence[Row]) -> str:
    """Return the same table as Markdown."""
    columns = choose_columns(rows)
    lines = [["", *(column[0] for column in columns)], ["---"] * (len(columns) + 1)]
    lines += [[row["label"], *format_cells(row, columns)] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _estimate(row: Row) -> float:
    sizes = row["bytes"]
    total: float = sizes["motion_estimate_kb_per_frame"] + sizes["births_estimate_kb_per_frame"]
    return total
