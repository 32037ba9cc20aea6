"""Formats the rate tables as Markdown and CSV."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict

from quarc_ref.inspection.stream_summary import KILOBYTE
from rate.claims import Claim
from rate.hull import Point, upper_hull
from rate.rows import Row

_HOLDS = {True: "yes", False: "**no**", None: "no number"}


def format_rows(rows: Iterable[Row], moved: Mapping[tuple[str, str], int]) -> str:
    """Return the table of sizes.

    Args:
        rows: To show.
        moved: Number of frames that are not canonical, for every capture and preset.
    """
    head = (
        "capture", "preset", "coded as", "canonical KB", "snapshots KB", "motion KB per frame",
        "updates KB per frame", "births KB per frame",
        "rest KB", "whole KB", "PSNR frame 0 / mean", "remark",
    )  # fmt: skip
    lines = []
    for row in rows:
        frames = moved[row.capture, row.preset] * KILOBYTE
        quality = [_number(row.psnr_first, 1), _number(row.psnr_mean, 1)]
        lines.append([
            row.capture, row.preset, row.coder, _number(row.canonical, KILOBYTE, 1),
            _number(row.snapshots, KILOBYTE, 1), _number(row.motion, frames, 3),
            _number(row.updates, frames, 3), _number(row.births, frames, 3),
            _number(row.rest, KILOBYTE), _number(row.total, KILOBYTE, 1),
            " / ".join(each for each in quality if each), row.remark,
        ])  # fmt: skip
    return format_table(head, lines)


def format_claims(claims: Mapping[str, Sequence[Claim]]) -> str:
    """Return the table of claims, given as `{capture: claims}`."""
    lines = [
        [
            capture,
            claim.name,
            _number(claim.value, 1, 3),
            f"{'at most' if claim.is_ceiling else 'at least'} {claim.bound:g}",
            _HOLDS[claim.holds],
        ]
        for capture, listed in claims.items()
        for claim in listed
    ]
    return format_table(("capture", "claim", "is", "asked", "holds"), lines)


def format_points(points: Mapping[str, Sequence[Point]]) -> str:
    """Return the table of sweeps, given as `{capture: points}`."""
    lines = []
    for capture, swept in points.items():
        hull = upper_hull(swept)
        for point in swept:
            on_hull = "yes" if point in hull else ""
            numbers = [f"{point.kilobytes:.3f}", f"{point.psnr:.3f}"]
            lines.append([capture, point.label or "the default", *numbers, on_hull])
    return format_table(("capture", "settings", "KB per frame", "PSNR", "on the hull"), lines)


def format_table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    rows = [head, ["---"] * len(head), *lines]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def write_csv(records: Sequence[Mapping[str, object]]) -> bytes:
    """Return records with the same keys as CSV, one line for each; None is an empty cell."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(records[0]) if records else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue().encode()


def list_row_records(rows: Iterable[Row]) -> list[dict[str, object]]:
    """Return rows by the names of their columns."""
    return [asdict(row) for row in rows]


def list_claim_records(claims: Mapping[str, Sequence[Claim]]) -> list[dict[str, object]]:
    """Return claims by the names of their columns, given as `{capture: claims}`."""
    return [
        {"capture": capture, **claim.as_json()}
        for capture, listed in claims.items()
        for claim in listed
    ]


def list_point_records(points: Mapping[str, Sequence[Point]]) -> list[dict[str, object]]:
    """Return points by the names of their columns, given as `{capture: points}`."""
    return [
        {"capture": capture, **asdict(point), "on_hull": point in upper_hull(swept)}
        for capture, swept in points.items()
        for point in swept
    ]


def _number(value: float | None, unit: float, digits: int = 2) -> str:
    return "" if value is None or not unit else f"{value / unit:,.{digits}f}"
