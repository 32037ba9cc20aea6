"""Formats the rate tables as Markdown and CSV."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict

from quarc_ref.inspection.stream_summary import KILOBYTE
from rate.claims import Claim
from rate.hull import Point, find_upper_hull
from rate.rows import Row

_HOLDS_TEXTS = {True: "yes", False: "**no**", None: "not measured"}


def format_rows(rows: Iterable[Row], later_frame_counts: Mapping[tuple[str, str], int]) -> str:
    """Return the table of sizes as Markdown.

    Args:
        rows: Rows of the table.
        later_frame_counts: Numbers of frames that are not canonical, by capture and preset.
    """
    header = (
        "capture", "preset", "coded as", "canonical frame, KB", "snapshots, KB",
        "motion, KB per frame", "updates, KB per frame", "births, KB per frame",
        "rest, KB", "total, KB", "PSNR in dB: frame 0 / mean", "remark",
    )  # fmt: skip
    lines = []
    for row in rows:
        divisor = later_frame_counts[row.capture, row.preset] * KILOBYTE  # for sizes per frame
        psnr_texts = [_format_number(row.psnr_first, 1), _format_number(row.psnr_mean, 1)]
        lines.append([
            row.capture, row.preset, row.coder, _format_number(row.canonical, KILOBYTE, 1),
            _format_number(row.snapshots, KILOBYTE, 1), _format_number(row.motion, divisor, 3),
            _format_number(row.updates, divisor, 3), _format_number(row.births, divisor, 3),
            _format_number(row.rest, KILOBYTE), _format_number(row.total, KILOBYTE, 1),
            " / ".join(text for text in psnr_texts if text), row.remark,
        ])  # fmt: skip
    return format_table(header, lines)


def format_claims(claims: Mapping[str, Sequence[Claim]]) -> str:
    """Return the table of claims as Markdown, given `{capture: claims}`."""
    lines = [
        [
            capture,
            claim.name,
            _format_number(claim.value, 1, 3),
            f"{'at most' if claim.is_maximum else 'at least'} {claim.bound:g}",
            _HOLDS_TEXTS[claim.holds],
        ]
        for capture, capture_claims in claims.items()
        for claim in capture_claims
    ]
    return format_table(("capture", "claim", "measured", "limit", "holds"), lines)


def format_points(points: Mapping[str, Sequence[Point]]) -> str:
    """Return the table of sweeps as Markdown, given `{capture: points}`."""
    lines = []
    for capture, capture_points in points.items():
        hull = find_upper_hull(capture_points)
        for point in capture_points:
            on_hull = "yes" if point in hull else ""
            numbers = [f"{point.kilobytes:.3f}", f"{point.psnr:.3f}"]
            lines.append([capture, point.label or "the default", *numbers, on_hull])
    return format_table(("capture", "settings", "KB per frame", "PSNR in dB", "on the hull"), lines)


def format_table(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    rows = [header, ["---"] * len(header), *lines]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def format_csv(records: Sequence[Mapping[str, object]]) -> bytes:
    """Return the records as CSV, with a column for each key; missing values and None are empty."""
    text = io.StringIO()
    names = list(dict.fromkeys(name for record in records for name in record))
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue().encode()


def list_row_records(rows: Iterable[Row]) -> list[dict[str, object]]:
    """Return each row as a dict of its columns."""
    return [asdict(row) for row in rows]


def list_claim_records(claims: Mapping[str, Sequence[Claim]]) -> list[dict[str, object]]:
    """Return each claim as a dict of its columns, given `{capture: claims}`."""
    return [
        {"capture": capture, **claim.as_json()}
        for capture, capture_claims in claims.items()
        for claim in capture_claims
    ]


def list_point_records(points: Mapping[str, Sequence[Point]]) -> list[dict[str, object]]:
    """Return each point as a dict of its columns, given `{capture: points}`."""
    return [
        {"capture": capture, **asdict(point), "on_hull": point in find_upper_hull(capture_points)}
        for capture, capture_points in points.items()
        for point in capture_points
    ]


def _format_number(value: float | None, divisor: float, digits: int = 2) -> str:
    return "" if value is None or not divisor else f"{value / divisor:,.{digits}f}"
