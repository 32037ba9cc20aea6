"""The `decode` command: writes the frames of a stream to files."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.decoded_files import Decoding, Written
from quarc_ref.cli.errors import STREAM_IS_BAD, UsageError, report_errors
from quarc_ref.cli.following import PATIENCE, FollowedName, FollowFlag, Patience, follow_stream
from quarc_ref.cli.options import AsJson, Force, Frames, Quiet, parse_frames
from quarc_ref.cli.output import TerminalProgress
from quarc_ref.cli.targets import growing_folder, written_folder, written_frame
from quarc_ref.export.table import EXPORTS
from quarc_ref.format.errors import BitstreamError, UnknownCriticalError
from quarc_ref.inspection.wording import count_noun

if TYPE_CHECKING:
    pass

_FORMATS = "; ".join(f"{row.suffix}: {row.title}" for row in EXPORTS.values()) + "."


def _check_format(name: str | None) -> str | None:
    """Return the name of a format; raise BadParameter if it is unknown."""
    if name is not None and name not in EXPORTS:
        message = f"{name!r} is not one of {', '.join(EXPORTS)}."
        raise typer.BadParameter(message)
    return name


def decode_frames(
    file: FollowedName,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="Folder to create; or a file, if a single frame is decoded or the format stores "
            "all frames in a file.",
        ),
    ],
    to: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help=_FORMATS,
            callback=_check_format,
            autocompletion=lambda: list(EXPORTS),
            show_default="from PATH's suffix, else ply",
        ),
    ] = None,
    frames: Frames = None,
    follow: FollowFlag = False,
    patience: Patience = PATIENCE,
    past_damage: Annotated[
        bool,
        typer.Option(
            "--recover", help="Continue decoding after damage, and report the lost frames."
        ),
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Decode frames into files for other programs, such as PATH/frame_0000.ply.

    PATH/sequence.json has frame rate, axes and cameras. A format with all frames in one file writes
    PATH/frames.usdc or similar. With --follow, each file appears as soon as its frame is decoded;
    otherwise, all files appear at the end.
    """
    waiting = follow_stream(file, patience, follow=follow)
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.inspection.inspect_stream import count_frames
        from quarc_ref.streams import open_source

        wanted = parse_frames(frames)
        one = _names_a_file(output, to)
        export = EXPORTS[output.suffix.lower().removeprefix(".") if one else to or "ply"]
        export.require()
        written = Written(export, with_sidecar=not one)
        make = written_frame if one else growing_folder if follow else written_folder
        dropping = nullcontext() if follow or past_damage else _suggest_recovery(written, frames)
        with make(output, force=force) as folder, open_source(file) as source, dropping:
            total = 0 if follow else count_frames(source)
            decoding = Decoding(source, waiting, written.gaps if past_damage else None)
            for scene in decoding.scenes(*wanted):
                written.add(folder, scene, decoding.clip)
                done = scene.frame + 1
                progress.advance("decode", min(done, total) if total else done, total)
            written.finish(folder)
            if not written.names and not written.gaps:
                has = f"; it has {count_noun(total, 'frame')}" if total else ""
                message = f"--frames {frames}: the stream has none of these frames{has}"
                raise UsageError(message if frames else "the stream has no frames")
            if not written.names:
                written.show(None, as_json=as_json, past_damage=past_damage)
                raise typer.Exit(STREAM_IS_BAD)
        written.show(output, as_json=as_json, past_damage=past_damage)
        if written.gaps:
            raise typer.Exit(STREAM_IS_BAD)


@contextmanager
def _suggest_recovery(written: "Written", frames: str | None) -> Iterator[None]:
    """Add the number of frames that `--recover` would keep to the message of a stream error."""
    try:
        yield
    except UnknownCriticalError:  # an unknown critical chunk stops --recover as well
        raise
    except BitstreamError as error:
        if written.names:
            asked = f" of --frames {frames}" if frames else ""
            count = len(written.names)
            error.add_note(
                f"complete frames{asked} before the error: {count}; --recover keeps them"
            )
        raise


def _names_a_file(output: Path, to: str | None) -> bool:
    """Return whether an output path names a file rather than a folder.

    Raises:
        UsageError: The suffix of the path and `--to` name different formats.
    """
    kind = output.suffix.lower().removeprefix(".")
    if kind in EXPORTS and to not in (kind, None):
        message = f"the suffix of {output} conflicts with --to {to}: change one of them"
        raise UsageError(message)
    return kind in EXPORTS
