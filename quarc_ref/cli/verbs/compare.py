"""The `compare` command: measures streams and other methods side by side."""

from collections import Counter
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import (
    AsJson,
    Force,
    Frames,
    LpipsWeights,
    Quiet,
    check_folder,
    check_path_exists,
    parse_frames,
    require_path_name,
)
from quarc_ref.cli.output import TerminalProgress, print_columns, print_json, print_message
from quarc_ref.cli.perceptual import load_lpips
from quarc_ref.cli.targets import reject_input_folder, written_folder
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.evaluation.comparison.measure import Comparison
    from quarc_ref.evaluation.comparison.open_entries import EntrySource
    from quarc_ref.evaluation.comparison.summary import Summary

_MIN_ENTRIES = 2
_MAX_DIGITS = 20  # sizes in bytes have fewer digits


def _check_entries(texts: list[str]) -> list[str]:
    for text in texts:
        require_path_name(text)
        require_path_name(text.partition("=")[2])
        check_path_exists(str(_parse_entry(text)[1]))
    return texts


def _check_capture(path: Path | None) -> Path | None:
    return None if path is None else check_folder(path)


def compare(
    entries: Annotated[
        list[str],
        typer.Argument(
            metavar="[METHOD[@POINT]=]PATH...",
            help="A stream, a folder with one PLY file per frame, a folder of renders "
            "(CAMERA/FRAME.png or FRAME/CAMERA.png), or a .4dgs file. Entries of the same METHOD "
            "form one curve; entries of the same METHOD@POINT are runs with the same settings.",
            show_default=False,
            callback=_check_entries,
        ),
    ],
    capture: Annotated[
        Path | None,
        typer.Option(
            "--capture",
            metavar="CAPTURE",
            help="Capture whose pictures are the ground truth.",
            show_default="the first entry is the ground truth",
            callback=_check_capture,
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report", metavar="DIR", help="Write a report with pictures, plots and CSV files."
        ),
    ] = None,
    cameras: Annotated[
        list[str] | None,
        typer.Option(
            "--camera",
            metavar="NAME",
            help="Camera to compare on; may be repeated.",
            show_default="the held-out cameras",
        ),
    ] = None,
    frames: Frames = None,
    lpips: LpipsWeights = None,
    sizes: Annotated[
        list[str] | None,
        typer.Option(
            "--bytes",
            metavar="ENTRY=N",
            help="Size N in bytes of what the method of an entry stores for all frames; ENTRY is a "
            "path or METHOD@POINT, but not that of a stream.",
        ),
    ] = None,
    downscale: Annotated[
        int,
        typer.Option(
            "--downscale",
            min=1,
            help="Downscale the capture's pictures by this factor; not allowed if an entry is a "
            "stream, which determines the size.",
        ),
    ] = 1,
    other_capture: Annotated[
        bool,
        typer.Option(
            "--other-capture", help="Measure streams even if they were made from another capture."
        ),
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure streams and other methods side by side, on the same cameras and frames."""
    with report_errors():
        from quarc_ref.evaluation.comparison.measure import measure_entries
        from quarc_ref.evaluation.comparison.open_entries import ComparisonOptions, open_entries
        from quarc_ref.evaluation.comparison.summary import summarize
        from quarc_ref.evaluation.same_capture import MismatchError, OtherCaptureError

        entry_sources = parse_entries(entries, sizes or [])
        if report is not None:
            reject_input_folder(report, (capture, *(entry.path for entry in entry_sources)))
        frame_range = parse_frames(frames)
        lpips_metric = load_lpips(lpips)
        options = ComparisonOptions(
            capture, tuple(cameras or ()), downscale, other_capture, stop=frame_range[1]
        )
        target = written_folder(report, force=force) if report else nullcontext()
        with TerminalProgress(quiet=quiet) as progress, target as folder:
            try:
                opened_entries = open_entries(entry_sources, options, progress.advance)
                comparison = measure_entries(
                    opened_entries, frame_range, lpips_metric, progress.advance
                )
            except OtherCaptureError as error:
                message = f"{error}: use --other-capture to measure the stream anyway"
                raise UsageError(message) from error
            except MismatchError as error:
                raise UsageError(str(error)) from error
            summary = summarize(comparison)
            if folder:
                from quarc_ref.evaluation.comparison.page import write_comparison

                write_comparison(comparison, summary, folder)
        page = report / "index.html" if report else None
        _print_result(comparison, summary, page, as_json=as_json)


def parse_entries(texts: Sequence[str], sizes: Sequence[str]) -> "list[EntrySource]":
    """Parse the entries on the command line.

    Raises:
        UsageError: There are fewer than two entries, a size is malformed, or a size is given for
            neither the path nor the label of an entry.
    """
    from quarc_ref.evaluation.comparison.entries import Label
    from quarc_ref.evaluation.comparison.open_entries import EntrySource

    if len(texts) < _MIN_ENTRIES:
        message = "compare needs at least two entries: give two or more paths"
        raise UsageError(message)
    names_and_paths = [_parse_entry(text) for text in texts]
    entry_sources = [
        EntrySource(Label(method, point), path)
        for (method, point), (_, path) in zip(
            _label_entries(names_and_paths), names_and_paths, strict=True
        )
    ]
    for name, byte_count in map(_parse_size, sizes):
        named = [name == str(it.label) or Path(name) == it.path for it in entry_sources]
        if not any(named):
            message = f"--bytes names {name}, which is not one of the entries"
            raise UsageError(message)
        entry_sources = [
            replace(source, byte_count=byte_count) if is_named else source
            for source, is_named in zip(entry_sources, named, strict=True)
        ]
    return entry_sources


def _label_entries(names_and_paths: Sequence[tuple[str, Path]]) -> list[tuple[str, str]]:
    """Return the method and operating point of each entry.

    Names that are not given are derived from paths: the file name if it is distinct, otherwise the
    whole path, so that only entries with the same given METHOD@POINT, or path, are runs.
    """
    paths = [path for _, path in names_and_paths]
    stem_counts = Counter(path.stem for path in paths)
    distinct_names = [path.stem if stem_counts[path.stem] == 1 else str(path) for path in paths]
    methods_and_points = []
    for (name, path), distinct_name in zip(names_and_paths, distinct_names, strict=True):
        # In a whole path, @ is part of the name of a folder.
        given_name = name or (path.stem if distinct_name == path.stem else "")
        method, _, point = given_name.partition("@")
        methods_and_points.append((method or distinct_name, point))
    method_counts = Counter(method for method, _ in methods_and_points)
    return [
        (method, point or (method if method_counts[method] == 1 else distinct_name))
        for (method, point), distinct_name in zip(methods_and_points, distinct_names, strict=True)
    ]


def _parse_entry(text: str) -> tuple[str, Path]:
    """Return the name of an entry, which may be empty, and its path."""
    name, equals, path = text.partition("=")
    if not equals or Path(text).exists():
        name, path = "", text
    return name, Path(path)


def _parse_size(text: str) -> tuple[str, int]:
    name, _, number = text.rpartition("=")
    if not name or not number.isdecimal() or len(number) >= _MAX_DIGITS:
        message = f"--bytes takes ENTRY=N with a whole number N, not {text!r}"
        raise UsageError(message)
    return name, int(number)


def _print_result(
    comparison: "Comparison", summary: "Summary", page: Path | None, *, as_json: bool
) -> None:
    from quarc_ref.evaluation.comparison import tables

    for message in tables.list_remarks(comparison):
        print_message(message)
    if as_json:
        report = {} if page is None else {"report": str(page)}
        print_json("compare/3", {**tables.as_json(comparison, summary), **report})
        return
    title = (
        f"Against {comparison.truth_description}: {format_count(len(comparison.frames), 'frame')} "
        f"of {', '.join(comparison.cameras)}"
    )
    headings = [f"<{heading}" if heading in ("entry", "kind") else heading
                for heading in tables.list_point_headings(summary)]  # fmt: skip
    print_columns(title, headings, tables.format_point_rows(summary))
    if summary.deltas:
        first_heading, *other_headings = tables.list_delta_headings(summary)
        rows = tables.format_delta_rows(summary)
        print_columns(
            "Bjontegaard deltas",
            [f"<{first_heading}", *other_headings[:-1], f"<{other_headings[-1]}"],
            rows,
        )
    if page is not None:
        print_columns("", ["<report"], [[str(page)]])
