"""The verbs that need a stream alone: info, verify, decode."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.faults import UsageError, reported_faults
from quarc_ref.cli.options import AsJson, Force, Quiet, StreamFile, parse_frames
from quarc_ref.cli.output import TerminalProgress, print_json, print_table
from quarc_ref.cli.targets import written_folder
from quarc_ref.format.errors import BitstreamError

if TYPE_CHECKING:
    from quarc_ref.decoder import Scene
    from quarc_ref.evaluation.inspect_stream import StreamSummary

_MADE = ("frame_*.ply", "frame_*.npz")


def info(file: StreamFile, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Show what a stream is made of: counts, real bytes by kind, the paper's estimate beside."""
    with reported_faults():
        from quarc_ref.evaluation.inspect_stream import inspect_stream

        with TerminalProgress(quiet=quiet) as progress:
            summary = inspect_stream(file.read_bytes(), progress.advance)
        if as_json:
            print_json(summary.as_json())
        else:
            print_table(file.name, describe(summary))


def verify(file: StreamFile, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Decode a stream from end to end and check every CRC and every state."""
    with reported_faults():
        from quarc_ref.decoder import compute_digest, decode

        frames, digest, data = 0, None, file.read_bytes()
        try:
            with TerminalProgress(quiet=quiet) as progress:
                for scene in _counted(decode(data), data, progress):
                    frames, digest = frames + 1, compute_digest(scene)
        except BitstreamError as error:
            if as_json:
                print_json({"valid": False, "frames": frames, "refused": error.reject_id})
            raise
        if as_json:
            print_json({"valid": True, "frames": frames, "state_sha256": digest})
        else:
            lines = {"valid": "yes", "frames": str(frames), "last state": str(digest)}
            print_table(file.name, lines)


def decode_frames(
    file: StreamFile,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to make.")],
    to: Annotated[
        Literal["ply", "npz"], typer.Option("--to", help="3DGS PLY, or NumPy arrays.")
    ] = "ply",
    frames: Annotated[
        str | None,
        typer.Option(
            "--frames", metavar="A:B", help="Frames from A up to, and without, B; all by default."
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Decode frames into files that other programs read: DIR/frame_0000.ply and so on."""
    with reported_faults(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.decoder import decode

        start, stop = parse_frames(frames)
        names: list[str] = []
        with written_folder(output, _MADE, force=force) as folder:
            data = file.read_bytes()
            for scene in _counted(decode(data, start, stop), data, progress):
                name = f"frame_{scene.frame:04}.{to}"
                (folder / name).write_bytes(_export(scene, to))
                names.append(name)
            if not names:
                message = f"the stream holds no frame of {frames or ':'}"
                raise UsageError(message)
    if as_json:
        print_json({"folder": str(output), "files": names})
    else:
        print_table(str(output), {"files": f"{len(names)}, {names[0]} to {names[-1]}"})


def describe(summary: "StreamSummary") -> dict[str, str]:
    """Return the lines of `info` as names and values."""
    from quarc_ref.evaluation.inspect_stream import KINDS

    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    rates, header = summary.kilobytes_per_frame(), summary.header
    lines = {
        "frames": f"{len(summary.frames)} at {header.frames_per_second:g} per second",
        "Gaussians": f"{summary.gaussian_count:,}, SH degree {header.sh_degree}",
        "anchors": f"{summary.anchor_count:,} on {header.level_count} levels, "
        f"drawn every {_count_frames(header.resample_interval)}",
        "whole stream": f"{coded['total']:,} bytes",
    }
    for kind in KINDS:
        lines[kind] = f"{coded[kind]:,} bytes (zero-order estimate {estimate[kind]:,})"
    lines["overhead"] = f"{coded['overhead']:,} bytes"
    lines["KB per frame"] = (
        f"{rates['without_canonical']:.2f} without canonical, "
        f"{rates['with_canonical']:.2f} with; a KB is 1024 bytes"
    )
    lines["world"] = (
        f"{'right' if header.right_handed else 'left'}-handed, up {_AXES[header.up_axis]}, "
        f"{header.meters_per_unit or 'unknown'} meters per unit"
    )
    lines["cameras"] = ", ".join(
        camera.name + (" (held out)" if camera.held_out else "") for camera in summary.cameras
    )
    unsaid = summary.metadata.keys() - lines.keys() - {"settings"}
    return lines | {key: text for key, text in summary.metadata.items() if key in unsaid}


def _count_frames(count: int) -> str:
    return "frame" if count == 1 else f"{count} frames"


def _counted(
    scenes: "Iterator[Scene]", data: bytes, progress: TerminalProgress
) -> "Iterator[Scene]":
    """Yield scenes, and tell how far into the stream each of them is."""
    from quarc_ref.evaluation.inspect_stream import count_frames

    total = count_frames(data)
    for scene in scenes:
        progress.advance("decode", min(scene.frame + 1, total), total)
        yield scene


def _export(scene: "Scene", to: str) -> bytes:
    from quarc_ref.decoder import dequantize
    from quarc_ref.export.arrays_npz import build_npz
    from quarc_ref.export.gaussian_ply import build_ply

    splats = dequantize(scene)
    return build_ply(splats) if to == "ply" else build_npz(scene, splats)


_AXES = ("unknown", "+x", "-x", "+y", "-y", "+z", "-z")
