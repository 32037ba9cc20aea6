"""The `encode` command: encodes a capture to a stream in a file or pipe."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.completion import complete_preset
from quarc_ref.cli.encode_job import (
    EncodeJob,
    WriteMode,
    choose_pool,
    encode_to_file,
    encode_to_joined_file,
    encode_to_pipe,
)
from quarc_ref.cli.encode_monitors import LogOptions, opened_monitors
from quarc_ref.cli.encode_warnings import Warnings
from quarc_ref.cli.encoder_options import as_settings, configure, print_settings, require_positive
from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import (
    STANDARD_STREAM,
    AsJson,
    CaptureFolder,
    Force,
    Quiet,
    Seed,
    Settings,
)
from quarc_ref.cli.output import TerminalProgress, print_json, print_table
from quarc_ref.cli.verbs.stream import describe

if TYPE_CHECKING:
    from quarc_ref.encoder.settings.config import EncoderConfig

_PRESET_HELP = (
    "main: best quality for its bytes; demo: several times quicker, for a first look; "
    "paper: the paper's schedule and steps."
)


def _list_settings(asked: bool) -> None:
    if asked:
        with report_errors():
            print_settings()
        raise typer.Exit


def encode(
    capture: CaptureFolder,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Stream to write; - for standard output."
        ),
    ],
    frames: Annotated[
        int | None,
        typer.Option("--frames", min=1, help="Number of frames to encode.", show_default="all"),
    ] = None,
    start: Annotated[
        int, typer.Option("--start", min=0, help="First frame of the capture to encode.")
    ] = 0,
    downscale: Annotated[
        int, typer.Option("--downscale", min=1, help="Downscale the pictures by this factor.")
    ] = 1,
    preset: Annotated[
        str, typer.Option("--preset", help=_PRESET_HELP, autocompletion=complete_preset)
    ] = "main",
    settings: Settings = None,
    list_settings: Annotated[
        bool,
        typer.Option(
            "--list-settings",
            help="Print all settings, with their value in each preset, their range and their "
            "meaning.",
            is_eager=True,
            callback=_list_settings,
        ),
    ] = False,
    version: Annotated[
        Literal["1.0", "1.1"],
        typer.Option(
            "--format",
            help="Format version: 1.1 allows updates of single Gaussians; 1.0 is for decoders "
            "without support for 1.1.",
        ),
    ] = "1.1",
    keyframe_interval: Annotated[
        int | None,
        typer.Option(
            "--keyframe-interval",
            min=1,
            metavar="N",
            help="Make every N-th frame a keyframe (a canonical frame): decoding, cut and join can "
            "start there.",
            show_default="only frame 0",
        ),
    ] = None,
    snapshot_interval: Annotated[
        int | None,
        typer.Option(
            "--snapshot-interval",
            min=1,
            metavar="N",
            help="Make every N-th frame a snapshot: like a keyframe, but about a third of the "
            "size; not in format 1.0.",
            show_default="none",
        ),
    ] = None,
    quality: Annotated[
        float | None,
        typer.Option(
            "--quality",
            metavar="Q",
            min=0,
            max=100,
            help="Quality, 0 to 100: each 20 more halve the weight of bytes (--lambda).",
            show_default="50",
        ),
    ] = None,
    rd_lambda: Annotated[
        float | None,
        typer.Option(
            "--lambda",
            metavar="X",
            help="Rate-distortion lambda, relative to the preset: larger means fewer bytes, lower "
            "quality.",
            show_default="1",
        ),
    ] = None,
    target: Annotated[
        float | None,
        typer.Option(
            "--target-kb-per-frame",
            metavar="K",
            help="Target size in KB of a frame that is not a keyframe; lambda is adapted from "
            "frame to frame.",
            show_default="no target",
        ),
    ] = None,
    seed: Seed = 0,
    held_out: Annotated[
        list[str] | None,
        typer.Option(
            "--held-out",
            metavar="NAME",
            help="Camera held out of training, for eval; may be repeated.",
            show_default="the first",
        ),
    ] = None,
    device: Annotated[
        Literal["auto", "cpu", "cuda"], typer.Option("--device", help="Device to train on.")
    ] = "auto",
    live: Annotated[
        bool,
        typer.Option(
            "--live", help="Write to FILE directly, so that other programs can read it meanwhile."
        ),
    ] = False,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Resume an interrupted encode with the same settings; the output is "
            "byte-identical.",
        ),
    ] = False,
    segments: Annotated[
        int | None,
        typer.Option(
            "--segments",
            min=1,
            metavar="K",
            help="Encode the frames in K segments, several at a time, and join them.",
            show_default="one stream",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            min=1,
            help="Number of segments encoded at the same time on this machine.",
            show_default="one per CPU core",
        ),
    ] = None,
    ray: Annotated[
        str | None,
        typer.Option(
            "--ray", metavar="ADDRESS", help="Encode segments on a Ray cluster: host:port, or auto."
        ),
    ] = None,
    no_checks: Annotated[
        bool,
        typer.Option(
            "--no-checks",
            help="Do not check cameras, poses and points before encoding.",
        ),
    ] = False,
    log_json: Annotated[
        Path | None,
        typer.Option(
            "--log-json",
            metavar="FILE",
            help="Write one JSON line for every training step and frame, when it is finished.",
        ),
    ] = None,
    tensorboard: Annotated[
        Path | None,
        typer.Option(
            "--tensorboard", metavar="DIR", help="Write losses, PSNR and sizes for TensorBoard."
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Encode multi-view video into a stream."""
    del list_settings
    with report_errors():
        to_pipe = str(output) == STANDARD_STREAM
        if to_pipe:
            piped = {"--json": as_json, "--live": live, "--resume": resume}
            _reject_with("-o -", piped | {"--segments": segments is not None})
        if segments is None:
            _require_segments({"--workers": workers is not None, "--ray": ray is not None})
        else:
            logs = {"--log-json": log_json is not None, "--tensorboard": tensorboard is not None}
            _reject_with("--segments", {"--live": live, **logs})
        require_positive({"--lambda": rd_lambda, "--target-kb-per-frame": target})
        asked = {
            "canonical.keyframe_interval": keyframe_interval,
            "canonical.snapshot_interval": snapshot_interval,
            "quality": quality,
            "rd_lambda": rd_lambda,
            "target_kb_per_frame": target,
        }
        config = _change_settings(preset, settings, asked, seed, version)
        started, found = time.monotonic(), Warnings()
        wanted_logs = LogOptions(log_json, tensorboard, keep=resume, force=force)
        with (
            TerminalProgress(quiet=quiet) as progress,
            opened_monitors(wanted_logs, progress) as monitor,
        ):
            from quarc_ref.datasets.open_capture import CaptureOptions

            opening = CaptureOptions(downscale, tuple(held_out or ()), start=start)
            work = EncodeJob(
                capture, opening, config, frames, device, progress, found, not no_checks, monitor
            )
            wanted = WriteMode(force, live, resume)
            if segments is not None:
                pool = choose_pool(segments, workers, ray, device)
                encode_to_joined_file(work, output, wanted, segments, pool)
            else:
                _encode_whole(work, output, wanted)
        if not to_pipe:
            _show(output, found, round(time.monotonic() - started, 1), as_json=as_json)


def _encode_whole(work: EncodeJob, output: Path, wanted: WriteMode) -> None:
    """Encode all frames as one segment, to standard output or a file."""
    if str(output) == STANDARD_STREAM:
        encode_to_pipe(work, output)
    else:
        encode_to_file(work, output, wanted)


def _change_settings(
    preset: str, settings: list[str] | None, asked: dict[str, float | None], seed: int, version: str
) -> "EncoderConfig":
    """Return a preset with `--set` and the other settings options applied.

    Raises:
        UsageError: There is no such setting or value, or format 1.0 does not support it.
    """
    if version == "1.0":
        is_asked = asked["canonical.snapshot_interval"] is not None
        _reject_with("--format 1.0", {"--snapshot-interval": is_asked})
    old = ["stream.updates=false", "canonical.snapshot_interval=0"] if version == "1.0" else []
    return configure(preset, [*(settings or []), *as_settings(asked), *old], seed)


def _reject_with(what: str, asked: dict[str, bool]) -> None:
    """Raise UsageError if an option is given that conflicts with something else."""
    for option, is_given in asked.items():
        if is_given:
            message = f"{what} cannot be combined with {option}"
            raise UsageError(message)


def _require_segments(asked: dict[str, bool]) -> None:
    """Raise UsageError if an option is given that needs `--segments`."""
    for option, is_given in asked.items():
        if is_given:
            message = f"{option} needs --segments"
            raise UsageError(message)


def _show(output: Path, found: Warnings, seconds: float, *, as_json: bool) -> None:
    """Print a summary of the stream."""
    from quarc_ref.inspection.inspect_stream import inspect_stream

    summary = inspect_stream(output.read_bytes())
    if as_json:
        added = {"findings": found.as_json(), "seconds": seconds}
        print_json("encode/2", {"file": str(output), **summary.as_json(), **added})
    else:
        print_table(output.name, describe(summary) | {"seconds": f"{seconds}"})
