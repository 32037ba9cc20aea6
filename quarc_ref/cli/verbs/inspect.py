"""The `inspect` command: shows the contents of a stream by chunk and by frame."""

import sys
from itertools import zip_longest
from typing import TYPE_CHECKING

from quarc_ref.cli.errors import report_errors
from quarc_ref.cli.options import AsJson, Quiet, StreamName, format_stream_name
from quarc_ref.cli.output import TerminalProgress, print_columns, print_json

if TYPE_CHECKING:
    from quarc_ref.inspection.stream_summary import StreamSummary

_FRAME_HEADINGS = (
    *("frame", "<kind", "Gaussians", "born", "died", "updated"),
    *("chunk", "motion", "(est.)", "updates", "(est.)", "births", "(est.)"),
)


def inspect(file: StreamName, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Show the chunks, frames and symbols of a stream, with sizes and estimated entropy.

    Sizes are in bytes. An estimate is the zero-order entropy of the coded symbols.
    """
    with report_errors():
        from quarc_ref.inspection.inspect_stream import inspect_stream
        from quarc_ref.streams import open_source

        with TerminalProgress(quiet=quiet) as progress, open_source(file) as source:
            summary = inspect_stream(source, progress.advance)
        if as_json:
            print_json(
                "inspect/3",
                {
                    **summary.as_json(),
                    "chunks": [chunk.as_json() for chunk in summary.chunks],
                    "per_frame": [frame.as_json() for frame in summary.frames],
                    "symbols": summary.magnitudes().as_json(),
                },
            )
            return
        _print_chunks(f"{format_stream_name(file)}: chunks", summary)
        for print_section in (_print_frames, _print_symbols, _print_byte_totals):
            sys.stdout.write("\n")
            print_section(summary)


def _print_chunks(title: str, summary: "StreamSummary") -> None:
    rows = (
        (chunk.kind, f"{chunk.sequence}", f"{chunk.offset:,}", f"{chunk.byte_count:,}")
        for chunk in summary.chunks
    )
    print_columns(title, ("<type", "number", "offset", "bytes"), rows)


def _print_frames(summary: "StreamSummary") -> None:
    rows = []
    for frame in summary.frames:
        coded, estimate = frame.coded_bytes, frame.estimate_bytes
        size_cells = [
            text
            for kind in ("motion", "updates", "births")
            for text in _format_size_and_estimate(coded[kind], estimate[kind])
            if not frame.canonical
        ]
        counts = (
            frame.gaussians,
            frame.births,
            frame.deaths,
            frame.updates,
            frame.chunk_bytes,
        )
        rows.append(
            [f"{frame.frame}", frame.kind, *(f"{count:,}" for count in counts), *size_cells]
        )
    print_columns("frames", _FRAME_HEADINGS, rows)


def _print_symbols(summary: "StreamSummary") -> None:
    magnitudes = summary.magnitudes()
    columns = (magnitudes.translation, magnitudes.rotation)
    totals = [max(1, sum(column)) for column in columns]
    rows = [
        [
            f"{magnitude}",
            *(
                text
                for count, total in zip(counts, totals, strict=True)
                for text in (f"{count:,}", f"{count / total:.2%}")
            ),
        ]
        for magnitude, counts in enumerate(zip_longest(*columns, fillvalue=0))
        if any(counts)
    ]
    print_columns("symbols", ("magnitude", "translation", "", "rotation", ""), rows)


def _print_byte_totals(summary: "StreamSummary") -> None:
    from quarc_ref.inspection.stream_summary import KINDS

    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    rows = []
    for kind in KINDS:
        ratio = f"{coded[kind] / estimate[kind]:.3f}" if estimate[kind] else ""
        rows.append([kind, *_format_size_and_estimate(coded[kind], estimate[kind]), ratio])
    rows += [[kind, f"{coded[kind]:,}", "", ""] for kind in ("overhead", "total")]
    print_columns("bytes", ("<kind", "coded", "estimate", "coded / estimate"), rows)


def _format_size_and_estimate(coded: int, estimate: float) -> tuple[str, str]:
    return f"{coded:,}", f"{round(estimate):,}"
