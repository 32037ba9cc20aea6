"""The verb `decode`: frames of a stream as files of their own."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import STREAM_IS_BAD, UsageError, report_errors
from quarc_ref.cli.following import PATIENCE, FollowedName, FollowFlag, Patience, follow_stream
from quarc_ref.cli.options import AsJson, Force, Frames, Quiet, parse_frames
from quarc_ref.cli.output import TerminalProgress, print_json, print_table, tell
from quarc_ref.cli.targets import OneFrame, grown_folder, written_folder, written_frame
from quarc_ref.export.table import EXPORTS, Export
from quarc_ref.format.errors import BitstreamError, UnknownCriticalError

if TYPE_CHECKING:
    from quarc_ref.decoder import Scene
    from quarc_ref.export.clip import Clip
    from quarc_ref.export.table import FrameSequence
    from quarc_ref.files import MadeFolder
    from quarc_ref.format.cameras import Camera
    from quarc_ref.streams import Follow, Gap, Source

_FORMATS = "; ".join(f"{row.suffix}: {row.title}" for row in EXPORTS.values())


def _check_format(name: str | None) -> str | None:
    """Return the name of a format; raise BadParameter if there is no such one."""
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
            help="Folder to make, or a file: of one frame, or of all where the format holds all.",
        ),
    ],
    to: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help=f"{_FORMATS}.",
            callback=_check_format,
            autocompletion=lambda: list(EXPORTS),
            show_default="as PATH's name ends, else ply",
        ),
    ] = None,
    frames: Frames = None,
    follow: FollowFlag = False,
    patience: Patience = PATIENCE,
    past_damage: Annotated[
        bool, typer.Option("--recover", help="Go on past damage, and report what is missing.")
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Decode frames into files that other programs read: PATH/frame_0000.ply and so on.

    PATH/sequence.json tells frame rate, axes and cameras. Formats that hold all frames in one
    file make PATH/frames.usdc or the like. With --follow a file is there as soon as its frame
    is, else all come at the end.
    """
    waiting = follow_stream(file, patience, follow=follow)
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.inspection.inspect_stream import count_frames
        from quarc_ref.streams import open_source

        wanted = parse_frames(frames)
        one = _names_a_file(output, to)
        export = EXPORTS[output.suffix.lower().removeprefix(".") if one else to or "ply"]
        export.require()
        written = _Written(export, with_sidecar=not one)
        make = written_frame if one else grown_folder if follow else written_folder
        dropping = nullcontext() if follow or past_damage else _offer_recovery(written, frames)
        with make(output, force=force) as folder, open_source(file) as source, dropping:
            total = 0 if follow else count_frames(source)
            decoding = _Decoding(source, waiting, written.gaps if past_damage else None)
            for scene in decoding.scenes(*wanted):
                written.add(folder, scene, decoding.clip)
                done = scene.frame + 1
                progress.advance("decode", min(done, total) if total else done, total)
            written.finish(folder)
            if not written.names and not written.gaps:
                message = f"the stream has no frame{f' of {frames}' if frames else ''}"
                raise UsageError(message)
            if not written.names:
                written.show(None, as_json=as_json, past_damage=past_damage)
                raise typer.Exit(STREAM_IS_BAD)
        written.show(output.parent if one else output, as_json=as_json, past_damage=past_damage)
        if written.gaps:
            raise typer.Exit(STREAM_IS_BAD)


@contextmanager
def _offer_recovery(written: "_Written", frames: str | None) -> Iterator[None]:
    """Let a fault in a stream say how many frames are lost with it that need not be."""
    try:
        yield
    except UnknownCriticalError:  # recovery does not pass it either
        raise
    except BitstreamError as error:
        if written.names:
            asked = f" of {frames}" if frames else ""
            count = len(written.names)
            error.add_note(f"whole frames{asked} up to there: {count}, which --recover keeps")
        raise


class _Decoding:
    """Frames of a stream, and what it says of all of them.

    Args:
        source: The stream.
        follow: How long to wait for more; None not to.
        gaps: Where there is a list, decoding goes on past damage, and what is missing is added.
    """

    def __init__(self, source: "Source", follow: "Follow | None", gaps: "list[Gap] | None") -> None:
        from quarc_ref.decoder.stream_decoder import StreamDecoder

        self._source, self._follow, self._gaps = source, follow, gaps
        self._decoder = StreamDecoder()
        self._prologue: tuple[tuple[Camera, ...], dict[str, str]] | None = None

    @property
    def clip(self) -> "Clip":
        """What the stream has said so far."""
        from quarc_ref.export.clip import Clip

        decoder = self._decoder
        if self._prologue is not None:
            return Clip(decoder.header, *self._prologue)
        return Clip(decoder.header, decoder.cameras, decoder.metadata)

    def scenes(self, start: int, stop: int | None) -> "Iterator[Scene]":
        """Yield the scenes from one ordinal up to, and without, another."""
        from quarc_ref.streams import Gap, decode, recover
        from quarc_ref.streams.prologue import read_prologue

        if self._gaps is None:
            if start > 0 and self._source.size() is not None:  # the decoder will pass it over
                self._prologue = read_prologue(self._source)
            yield from decode(self._source, start, stop, self._follow, self._decoder)
            return
        for item in recover(self._source, self._follow, self._decoder):
            if isinstance(item, Gap):
                self._gaps.append(item)
                _tell(item)
            elif stop is not None and item.frame >= stop:
                return
            elif item.frame >= start:
                yield item


def _names_a_file(output: Path, to: str | None) -> bool:
    """Return whether a name is that of one file, and not of a folder.

    Raises:
        UsageError: It is the name of another format than `--to` asks for.
    """
    kind = output.suffix.lower().removeprefix(".")
    if kind in EXPORTS and to not in (kind, None):
        message = f"{output} does not go with --to {to}"
        raise UsageError(message)
    return kind in EXPORTS


class _Written:
    """What `decode` has made, and what is missing.

    Args:
        export: The format.
        with_sidecar: Whether `sequence.json` is written beside the frames.
    """

    def __init__(self, export: Export, *, with_sidecar: bool) -> None:
        self.names: list[str] = []
        self.gaps: list[Gap] = []
        self._export = export
        self._with_sidecar = with_sidecar
        self._sidecar: str | None = None
        self._sequence: FrameSequence | None = None

    def add(self, target: "MadeFolder | OneFrame", scene: "Scene", clip: "Clip") -> None:
        """Write a frame, or take it into the one file of all."""
        from quarc_ref.export.clip import Frame

        if self._with_sidecar and self._sidecar is None:
            self._write_sidecar(target, scene.frame, clip)
        frame = Frame.of(scene)
        if self._export.is_sequence:
            self._sequence = self._sequence or self._export.begin(clip)
            self._sequence.add(frame)
        else:
            data = self._export.builder()(frame, clip)
            name = f"frame_{scene.frame:04}.{self._export.suffix}"
            self.names.append(target.write(name, data).name)

    def finish(self, target: "MadeFolder | OneFrame") -> None:
        """Write the one file of all frames, if the format has one."""
        if self._sequence is not None:
            name = f"frames.{self._export.suffix}"
            self.names.append(target.write(name, self._sequence.finish()).name)

    def show(self, output: Path | None, *, as_json: bool, past_damage: bool) -> None:
        """Print what there is, in which folder, if there is one."""
        if as_json:
            gaps = {"gaps": [asdict(gap) for gap in self.gaps]} if past_damage else {}
            made = {"files": self.names, "sidecar": self._sidecar}
            print_json("decode/2", {"folder": output and str(output), **made, **gaps})
            return
        ends = f", {self.names[0]} to {self.names[-1]}" if len(self.names) > 1 else ""
        lines = {"files": f"{len(self.names)}{ends or ''.join(f', {it}' for it in self.names)}"}
        lines |= {"gaps": f"{len(self.gaps)}"} if past_damage else {}
        print_table(str(output or "no folder"), lines)

    def _write_sidecar(
        self, target: "MadeFolder | OneFrame", first_frame: int, clip: "Clip"
    ) -> None:
        from quarc_ref.export.sidecar import NAME, build_sidecar

        one = self._export.is_sequence
        pattern = (
            f"frames.{self._export.suffix}" if one else f"frame_{{frame:04}}.{self._export.suffix}"
        )
        self._sidecar = target.write(NAME, build_sidecar(clip, pattern, first_frame)).name


def _tell(gap: "Gap") -> None:
    """Report a gap on stderr."""
    size = "to the end" if gap.byte_count is None else f"{gap.byte_count:,} bytes"
    lost = "unknown" if gap.frames_lost is None else f"{gap.frames_lost}"
    line = f"gap at byte {gap.offset}, {size}, frames lost: {lost}: {gap.message}"
    tell(line)
