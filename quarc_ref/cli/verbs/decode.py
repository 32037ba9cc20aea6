"""The `decode` command: writes the frames of a stream to files."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.decoded_files import FrameDecoder, FrameWriter
from quarc_ref.cli.errors import EXIT_INVALID_STREAM, UsageError, report_errors
from quarc_ref.cli.following import (
    DEFAULT_PATIENCE,
    FollowedStreamName,
    FollowFlag,
    Patience,
    make_follow_options,
)
from quarc_ref.cli.options import AsJson, Force, Frames, Quiet, parse_frames
from quarc_ref.cli.output import TerminalProgress
from quarc_ref.cli.targets import (
    growing_folder,
    open_output_frame,
    reject_input_stream,
    written_folder,
)
from quarc_ref.export.table import EXPORT_FORMATS
from quarc_ref.format.errors import BitstreamError, UnknownCriticalError
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.streams import Source

_FORMAT_HELP = "; ".join(f"{row.suffix}: {row.title}" for row in EXPORT_FORMATS.values()) + "."


def _check_format(name: str | None) -> str | None:
    """Return the name of a format; raise BadParameter if it is unknown."""
    if name is not None and name not in EXPORT_FORMATS:
        message = f"{name!r} is not one of {', '.join(EXPORT_FORMATS)}."
        raise typer.BadParameter(message)
    return name


def decode_frames(
    file: FollowedStreamName,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="Folder to create, or a file if a single frame is decoded or the format stores "
            "all frames in one file.",
        ),
    ],
    to: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help=_FORMAT_HELP,
            callback=_check_format,
            autocompletion=lambda: list(EXPORT_FORMATS),
            show_default="from PATH's suffix, else ply",
        ),
    ] = None,
    frames: Frames = None,
    follow: FollowFlag = False,
    patience: Patience = DEFAULT_PATIENCE,
    recovers: Annotated[
        bool,
        typer.Option(
            "--recover", help="Continue decoding after damage, and report the lost frames."
        ),
    ] = False,
    bakes_filter: Annotated[
        bool,
        typer.Option(
            "--bake-filter",
            help="Add the low-pass filter of the capture's pictures to the scales of Gaussians, "
            "for viewers with a much higher resolution than the capture.",
        ),
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Decode frames into files for other programs, such as PATH/frame_0000.ply.

    PATH/sequence.json contains the frame rate, axes and cameras. If the format stores all frames in
    one file, that file is PATH/frames.usdc or similar. With --follow, each file appears as soon as
    its frame is decoded; otherwise, all files appear at the end.
    """
    follow_options = make_follow_options(file, patience, follow=follow)
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.inspection.inspect_stream import count_frames
        from quarc_ref.streams import open_source

        frame_range = parse_frames(frames)
        is_single_file = _is_file_output(output, to)
        reject_input_stream(output, file)
        export = EXPORT_FORMATS[
            output.suffix.lower().removeprefix(".") if is_single_file else to or "ply"
        ]
        export.require_library()
        writer = FrameWriter(export, with_sidecar=not is_single_file, bakes_filter=bakes_filter)
        open_target = (
            open_output_frame if is_single_file else growing_folder if follow else written_folder
        )
        recovery_hint = nullcontext() if follow or recovers else _suggest_recovery(writer, frames)
        with (
            open_target(output, force=force) as target,
            open_source(file, follow_options) as source,
            recovery_hint,
        ):
            total = 0 if follow else count_frames(source)
            decoder = FrameDecoder(source, follow_options, writer.gaps if recovers else None)
            for scene in decoder.decode_scenes(*frame_range):
                writer.add(target, scene, decoder.clip)
                done_count = scene.frame + 1
                progress.advance("decode", min(done_count, total) if total else done_count, total)
            writer.finish(target)
            if not writer.file_names and not writer.gaps:
                raise UsageError(_describe_missing_frames(source, frames, total))
            if not writer.file_names:
                writer.print_result(None, as_json=as_json, recovers=recovers)
                raise typer.Exit(EXIT_INVALID_STREAM)
        writer.print_result(output, as_json=as_json, recovers=recovers)
        if writer.gaps:
            raise typer.Exit(EXIT_INVALID_STREAM)


def _describe_missing_frames(source: "Source", frames: str | None, total: int) -> str:
    """Return the error message for a stream with `total` frames, none of which is requested."""
    from quarc_ref.viewing.outline import outline_stream

    if frames is None:
        return "the stream has no frames"
    available_text = ""
    if total:
        first_frame = outline_stream(source).first_frame
        available_text = f"; it has {format_count(total, 'frame')} from {first_frame} on"
    return f"the stream has none of the frames that --frames {frames} selects{available_text}"


@contextmanager
def _suggest_recovery(writer: "FrameWriter", frames: str | None) -> Iterator[None]:
    """If decoding fails, add to the error message how many frames `--recover` would keep."""
    try:
        yield
    except UnknownCriticalError:  # an unknown critical chunk stops --recover as well
        raise
    except BitstreamError as error:
        if writer.frame_count:
            range_text = f" of --frames {frames}" if frames else ""
            count = writer.frame_count
            error.add_note(
                f"complete frames{range_text} before the error: {count}; --recover keeps them"
            )
        raise


def _is_file_output(output: Path, to: str | None) -> bool:
    """Return whether an output path names a file rather than a folder.

    Raises:
        UsageError: The suffix of the path and `--to` name different formats, or none is named, but
            the path has another suffix, as if it were a file. Digits, as in `steak_0.5`, are no
            suffix.
    """
    suffix = output.suffix.lower().removeprefix(".")
    if suffix in EXPORT_FORMATS and to not in (suffix, None):
        message = f"the suffix of {output} conflicts with --to {to}: change one of them"
        raise UsageError(message)
    is_name_of_file = suffix not in ("", *EXPORT_FORMATS) and not suffix.isdecimal()
    if is_name_of_file and to is None and not output.is_dir():
        message = (
            f"the format is not clear from the name {output}: use one of the suffixes "
            f"{', '.join(EXPORT_FORMATS)} for a file, or no suffix for a folder of PLY files; or "
            "choose the format with --to"
        )
        raise UsageError(message)
    return suffix in EXPORT_FORMATS
