"""The `cut` and `join` commands, which copy frames of streams without re-encoding."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import (
    STANDARD_STREAM,
    AsJson,
    Force,
    StreamName,
    check_stream_name,
    parse_frames,
)
from quarc_ref.cli.output import print_fields, print_json
from quarc_ref.cli.targets import open_output_stream

_Target = Annotated[
    Path,
    typer.Option("--output", "-o", metavar="FILE", help="Stream to write; - for standard output."),
]


def _check_files(names: list[str]) -> list[str]:
    return [check_stream_name(name) for name in names]


def cut(
    file: StreamName,
    frames: Annotated[
        str,
        typer.Option(
            "--frames",
            metavar="A:B",
            help="Frames A to B - 1; A or B may be omitted. A must be a keyframe. A without a "
            "colon selects one frame.",
        ),
    ],
    output: _Target,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Extract frames from a stream without re-encoding; frame numbers do not change."""
    with report_errors():
        from quarc_ref.streams import open_source
        from quarc_ref.streams.cut import cut as cut_stream

        start, stop = parse_frames(frames)
        _reject_shared_output(output, as_json=as_json)
        with open_source(file) as source, open_output_stream(output, force=force) as sink:
            first = None if frames.startswith(":") else start
            count = cut_stream(source, first, stop, sink)
        _print_result("cut/1", output, count, as_json=as_json)


def join(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE",
            help="Streams in the order in which to join them: files or http(s) URLs.",
            show_default=False,
            callback=_check_files,
        ),
    ],
    output: _Target,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Join streams with the same header without re-encoding; decoded frames do not change."""
    with report_errors(), ExitStack() as stack:
        from quarc_ref.streams import open_source
        from quarc_ref.streams.join import join as join_streams

        if STANDARD_STREAM in files:
            message = (
                "join cannot read from standard input, because it reads every stream twice: save "
                "the stream to a file first"
            )
            raise UsageError(message)
        _reject_shared_output(output, as_json=as_json)
        sources = [stack.enter_context(open_source(name)) for name in files]
        with open_output_stream(output, force=force) as sink:
            count = join_streams(sources, sink)
        _print_result("join/1", output, count, as_json=as_json)


def _reject_shared_output(output: Path, *, as_json: bool) -> None:
    """Raise UsageError if both the stream and JSON would be written to standard output."""
    if as_json and str(output) == STANDARD_STREAM:
        message = "-o - and --json both write to standard output: give a path to -o"
        raise UsageError(message)


def _print_result(schema: str, output: Path, count: int, *, as_json: bool) -> None:
    """Print the frame count and the size of a stream, unless it was written to standard output."""
    if str(output) == STANDARD_STREAM:
        return
    size = output.stat().st_size
    if as_json:
        print_json(schema, {"file": str(output), "frames": count, "bytes": size})
    else:
        print_fields(output.name, {"frames": f"{count}", "whole stream": f"{size:,} bytes"})
