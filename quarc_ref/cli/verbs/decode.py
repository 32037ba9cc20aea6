"""The verb `decode`: frames of a stream as files of their own."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.errors import STREAM_IS_BAD, UsageError, report_errors
from quarc_ref.cli.following import PATIENCE, FollowedName, FollowFlag, Patience, follow_stream
from quarc_ref.cli.options import AsJson, Force, Frames, Quiet, parse_frames
from quarc_ref.cli.output import TerminalProgress, print_json, print_table, tell
from quarc_ref.cli.targets import OneFrame, grown_folder, written_folder, written_frame
from quarc_ref.format.errors import BitstreamError, UnknownCriticalError

if TYPE_CHECKING:
    from quarc_ref.decoder import Scene
    from quarc_ref.files import MadeFolder
    from quarc_ref.streams import Follow, Gap, Source

_KINDS = ("ply", "npz")


def decode_frames(
    file: FollowedName,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="Folder to make; for one frame, a file that ends in .ply or .npz.",
        ),
    ],
    to: Annotated[
        Literal["ply", "npz"] | None,
        typer.Option(
            "--to",
            help="3DGS PLY, or NumPy arrays.",
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

    With --follow a file is there as soon as its frame is, else all come at the end.
    """
    waiting = follow_stream(file, patience, follow=follow)
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.inspection.inspect_stream import count_frames
        from quarc_ref.streams import open_source

        wanted = parse_frames(frames)
        one = _names_a_frame(output, to)
        written = _Written(output.suffix.lower().removeprefix(".") if one else to or "ply")
        make = written_frame if one else grown_folder if follow else written_folder
        dropping = nullcontext() if follow or past_damage else _offer_recovery(written, frames)
        with make(output, force=force) as folder, open_source(file) as source, dropping:
            total = 0 if follow else count_frames(source)
            for scene in _decode(source, wanted, waiting, written.gaps if past_damage else None):
                written.add(folder, scene)
                done = scene.frame + 1
                progress.advance("decode", min(done, total) if total else done, total)
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


def _decode(
    source: "Source",
    wanted: tuple[int, int | None],
    follow: "Follow | None",
    gaps: "list[Gap] | None",
) -> "Iterator[Scene]":
    """Yield the scenes wanted; where there is a list for gaps, go on past damage."""
    from quarc_ref.streams import Gap, decode, recover

    start, stop = wanted
    if gaps is None:
        yield from decode(source, start, stop, follow)
        return
    for item in recover(source, follow):
        if isinstance(item, Gap):
            gaps.append(item)
            _tell(item)
        elif stop is not None and item.frame >= stop:
            return
        elif item.frame >= start:
            yield item


def _names_a_frame(output: Path, to: str | None) -> bool:
    """Return whether a name is that of a file for one frame, and not of a folder.

    Raises:
        UsageError: It is the name of another kind of file than `--to` asks for.
    """
    kind = output.suffix.lower().removeprefix(".")
    if kind in _KINDS and to not in (kind, None):
        message = f"{output} does not go with --to {to}"
        raise UsageError(message)
    return kind in _KINDS


class _Written:
    """What `decode` has made, and what is missing."""

    def __init__(self, to: str) -> None:
        self.names: list[str] = []
        self.gaps: list[Gap] = []
        self._to = to

    def add(self, target: "MadeFolder | OneFrame", scene: "Scene") -> None:
        """Write the file of a frame."""
        name = f"frame_{scene.frame:04}.{self._to}"
        self.names.append(target.write(name, _export(scene, self._to)).name)

    def show(self, output: Path | None, *, as_json: bool, past_damage: bool) -> None:
        """Print what there is, in which folder, if there is one."""
        if as_json:
            gaps = {"gaps": [asdict(gap) for gap in self.gaps]} if past_damage else {}
            print_json("decode/1", {"folder": output and str(output), "files": self.names, **gaps})
            return
        ends = f", {self.names[0]} to {self.names[-1]}" if self.names else ""
        lines = {"files": f"{len(self.names)}{ends}"}
        lines |= {"gaps": f"{len(self.gaps)}"} if past_damage else {}
        print_table(str(output or "no folder"), lines)


def _tell(gap: "Gap") -> None:
    """Report a gap on stderr."""
    size = "to the end" if gap.byte_count is None else f"{gap.byte_count:,} bytes"
    lost = "unknown" if gap.frames_lost is None else f"{gap.frames_lost}"
    line = f"gap at byte {gap.offset}, {size}, frames lost: {lost}: {gap.message}"
    tell(line)


def _export(scene: "Scene", to: str) -> bytes:
    from quarc_ref.decoder import dequantize
    from quarc_ref.export.arrays_npz import build_npz
    from quarc_ref.export.gaussian_ply import build_ply

    splats = dequantize(scene)
    return build_ply(splats) if to == "ply" else build_npz(scene, splats)
