"""The `encode` command: encodes a capture to a stream in a file or a pipe."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.encode_arguments import (
    Device,
    Downscale,
    FormatVersion,
    FrameCount,
    HeldOut,
    KeyframeInterval,
    Lambda,
    ListSettings,
    Live,
    LogFile,
    NoChecks,
    Output,
    Preset,
    QualityLevel,
    RayAddress,
    Resume,
    Segments,
    SnapshotInterval,
    Start,
    TargetSize,
    TensorBoardFolder,
    Workers,
    reject_with,
    require_segments,
)
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
from quarc_ref.cli.encoder_options import as_settings, configure, require_positive
from quarc_ref.cli.errors import report_errors
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


def encode(
    capture: CaptureFolder,
    output: Output,
    frames: FrameCount = None,
    start: Start = 0,
    downscale: Downscale = 1,
    preset: Preset = "main",
    settings: Settings = None,
    list_settings: ListSettings = False,
    version: FormatVersion = "1.1",
    keyframe_interval: KeyframeInterval = None,
    snapshot_interval: SnapshotInterval = None,
    quality: QualityLevel = None,
    rd_lambda: Lambda = None,
    target: TargetSize = None,
    seed: Seed = 0,
    held_out: HeldOut = None,
    device: Device = "auto",
    live: Live = False,
    resume: Resume = False,
    segments: Segments = None,
    workers: Workers = None,
    ray: RayAddress = None,
    no_checks: NoChecks = False,
    log_json: LogFile = None,
    tensorboard: TensorBoardFolder = None,
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
            reject_with("-o -", piped | {"--segments": segments is not None})
        if segments is None:
            require_segments({"--workers": workers is not None, "--ray": ray is not None})
        else:
            logs = {"--log-json": log_json is not None, "--tensorboard": tensorboard is not None}
            reject_with("--segments", {"--live": live, **logs})
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
                _encode_one_segment(work, output, wanted)
        if not to_pipe:
            _show(output, found, round(time.monotonic() - started, 1), as_json=as_json)


def _encode_one_segment(work: EncodeJob, output: Path, wanted: WriteMode) -> None:
    """Encode all frames as one segment, to standard output or a file."""
    if str(output) == STANDARD_STREAM:
        encode_to_pipe(work, output)
    else:
        encode_to_file(work, output, wanted)


def _change_settings(
    preset: str, settings: list[str] | None, asked: dict[str, float | None], seed: int, version: str
) -> "EncoderConfig":
    """Return the settings of a preset, changed by `--set` and by options such as `--lambda`.

    Raises:
        UsageError: A setting does not exist, its value is not allowed, or format 1.0 does not
            support the value.
    """
    if version == "1.0":
        is_asked = asked["canonical.snapshot_interval"] is not None
        reject_with("--format 1.0", {"--snapshot-interval": is_asked})
    old = ["stream.updates=false", "canonical.snapshot_interval=0"] if version == "1.0" else []
    return configure(preset, [*(settings or []), *as_settings(asked), *old], seed)


def _show(output: Path, found: Warnings, seconds: float, *, as_json: bool) -> None:
    """Print the sizes of the stream, the findings and the time of the encode."""
    from quarc_ref.inspection.inspect_stream import inspect_stream

    summary = inspect_stream(output.read_bytes())
    if as_json:
        added = {"findings": found.as_json(), "seconds": seconds}
        print_json("encode/2", {"file": str(output), **summary.as_json(), **added})
    else:
        print_table(output.name, describe(summary) | {"seconds": f"{seconds}"})
