"""The verbs that need a stream alone: info, verify, decode."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.faults import UsageError, reported_faults
from quarc_ref.cli.options import AsJson, Force, Quiet, StreamFile, parse_frames
from quarc_ref.cli.output import TerminalProgress, print_json, print_table, written_folder
from quarc_ref.format.errors import BitstreamError

if TYPE_CHECKING:
    from quarc_ref.decoder import Scene
    from quarc_ref.evaluation.inspect_stream import StreamSummary


def info(file: StreamFile, as_json: AsJson = False) -> None:
    """Show what a stream is made of: counts, real bytes by kind, the paper's estimate beside."""
    from quarc_ref.evaluation.inspect_stream import inspect_stream

    with reported_faults():
        summary = inspect_stream(file.read_bytes())
        if as_json:
            print_json(summary.as_json())
        else:
            print_table(file.name, describe(summary))


def verify(file: StreamFile, as_json: AsJson = False) -> None:
    """Decode a stream from end to end and check every CRC and every state."""
    from quarc_ref.decoder import compute_digest, decode

    with reported_faults():
        frames, digest = 0, None
        try:
            for scene in decode(file.read_bytes()):
                frames, digest = frames + 1, compute_digest(scene)
        except BitstreamError as error:
            if as_json:
                print_json({"valid": False, "frames": frames, "refused": error.reject_id})
            raise
        if as_json:
            print_json({"valid": True, "frames": frames, "state_sha256": digest})
        else:
            print_table(
                file.name,
                {"valid": "yes", "frames": str(frames), "state of the last": str(digest)},
            )


def decode_frames(
    file: StreamFile,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to make.")],
    to: Annotated[
        Literal["ply", "npz"], typer.Option("--to", help="3DGS PLY, or NumPy arrays.")
    ] = "ply",
    frames: Annotated[
        str | None, typer.Option("--frames", metavar="A:B", help="From frame A up to B.")
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Decode frames into files that other programs read: DIR/frame_0000.ply and so on."""
    from quarc_ref.decoder import decode

    with reported_faults(), TerminalProgress(quiet=quiet) as progress:
        start, stop = parse_frames(frames)
        names: list[str] = []
        with written_folder(output, force=force) as folder:
            for scene in decode(file.read_bytes(), start, stop):
                name = f"frame_{scene.frame:04}.{to}"
                (folder / name).write_bytes(_export(scene, to))
                names.append(name)
                progress.advance("decode", len(names), max(len(names), (stop or 0) - start))
            if not names:
                message = f"the stream holds no frame of {frames}"
                raise UsageError(message)
        if as_json:
            print_json({"folder": str(output), "files": names})


def describe(summary: "StreamSummary") -> dict[str, str]:
    """Return the lines of `info` as names and values."""
    from quarc_ref.evaluation.inspect_stream import KINDS

    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    rates = summary.kilobytes_per_frame()
    header, last = summary.header, summary.frames[-1]
    anchors = max((frame.anchors for frame in summary.frames), default=0)
    lines = {
        "frames": f"{len(summary.frames)} at {header.frames_per_second:g} per second",
        "Gaussians": f"{last.gaussians:,}, SH degree {header.sh_degree}",
        "anchors": f"{anchors:,} on {header.level_count} levels, "
        f"drawn every {header.resample_interval} frames",
        "whole stream": f"{coded['total']:,} bytes",
    }
    for kind in KINDS:
        lines[kind] = f"{coded[kind]:,} bytes (zero-order estimate {estimate[kind]:,})"
    lines["overhead"] = f"{coded['overhead']:,} bytes"
    lines["KB per frame"] = (
        f"{rates['without_canonical']:.2f} without canonical, {rates['with_canonical']:.2f} with"
    )
    lines["world"] = (
        f"{'right' if header.right_handed else 'left'}-handed, up {_AXES[header.up_axis]}, "
        f"{header.meters_per_unit or 'unknown'} meters per unit"
    )
    lines["cameras"] = ", ".join(
        camera.name + (" (held out)" if camera.held_out else "") for camera in summary.cameras
    )
    return lines | {key: value for key, value in summary.metadata.items() if key != "settings"}


def _export(scene: "Scene", to: str) -> bytes:
    from quarc_ref.decoder import dequantize
    from quarc_ref.export.arrays_npz import build_npz
    from quarc_ref.export.gaussian_ply import build_ply

    splats = dequantize(scene)
    return build_ply(splats) if to == "ply" else build_npz(scene, splats)


_AXES = ("unknown", "+x", "-x", "+y", "-y", "+z", "-z")
