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
    reject_conflicts,
    reject_segment_options,
)
from quarc_ref.cli.encode_findings import FindingCollector
from quarc_ref.cli.encode_job import (
    EncodeJob,
    WriteMode,
    choose_pool,
    encode_to_file,
    encode_to_joined_file,
    encode_to_pipe,
    is_remote_cluster,
)
from quarc_ref.cli.encode_monitors import LogOptions, open_monitors
from quarc_ref.cli.encoder_options import (
    format_settings,
    make_config,
    require_positive,
    require_quality,
)
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
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json
from quarc_ref.cli.stream_targets import reject_stream_path
from quarc_ref.cli.verbs.stream import describe_stream

if TYPE_CHECKING:
    from quarc_ref.encoder.settings.config import EncoderConfig


_UNSUPPORTED_IN_1_0 = ("stream.updates", "canonical.snapshot_interval")
_OFF_VALUES = ("false", "no", "0")


def encode(
    capture: CaptureFolder,
    output: Output,
    frames: FrameCount = None,
    start: Start = 0,
    downscale: Downscale = 1,
    preset: Preset = "main",
    settings: Settings = None,
    list_settings: ListSettings = False,
    format_version: FormatVersion = "1.1",
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
        writes_to_pipe = str(output) == STANDARD_STREAM
        if writes_to_pipe:
            conflicting_options = {"--json": as_json, "--live": live, "--resume": resume}
            reject_conflicts("-o -", conflicting_options | {"--segments": segments is not None})
        if segments is None:
            reject_segment_options({"--workers": workers is not None, "--ray": ray is not None})
        else:
            logs_given = {"--log-json": bool(log_json), "--tensorboard": bool(tensorboard)}
            reject_conflicts("--segments", {"--live": live, **logs_given})
        if log_json is not None:
            reject_stream_path(log_json, output)
        setting_values = {
            "canonical.keyframe_interval": keyframe_interval,
            "canonical.snapshot_interval": snapshot_interval,
            "quality": quality,
            "rd_lambda": rd_lambda,
            "target_kb_per_frame": target,
            "seed": seed or None,  # 0 is the default
        }
        config = _make_config_from_options(preset, settings, setting_values, format_version)
        start_time, findings = time.monotonic(), FindingCollector()
        logs = LogOptions(log_json, tensorboard, keep=resume, force=force)
        with TerminalProgress(quiet=quiet) as progress, open_monitors(logs, progress) as monitor:
            from quarc_ref.datasets.open_capture import CaptureOptions

            options = CaptureOptions(downscale, tuple(held_out or ()), start=start)
            job = EncodeJob(
                capture, options, config, frames, device, progress, findings, not no_checks,
                monitor, is_remote_cluster(ray),
            )  # fmt: skip
            write_mode = WriteMode(force, live, resume)
            if segments is not None:
                pool = choose_pool(segments, workers, ray, device)
                encode_to_joined_file(job, output, write_mode, segments, pool)
            else:
                _encode_whole(job, output, write_mode)
        if not writes_to_pipe:
            _print_result(output, findings, time.monotonic() - start_time, as_json=as_json)


def _encode_whole(job: EncodeJob, output: Path, write_mode: WriteMode) -> None:
    """Encode all frames without splitting them into segments, to standard output or a file."""
    if str(output) == STANDARD_STREAM:
        encode_to_pipe(job, output)
    else:
        encode_to_file(job, output, write_mode)


def _make_config_from_options(
    preset: str,
    settings: list[str] | None,
    setting_values: dict[str, float | None],
    format_version: str,
) -> "EncoderConfig":
    """Return the settings of a preset, changed by `--set` and by options such as `--lambda`.

    Raises:
        UsageError: A setting does not exist, its value or that of an option is not allowed, an
            option changes the same setting, or format 1.0 does not support the value.
    """
    require_quality(setting_values["quality"])
    require_positive(
        {
            "--lambda": setting_values["rd_lambda"],
            "--target-kb-per-frame": setting_values["target_kb_per_frame"],
        }
    )
    for setting in settings or []:
        key, _, text = setting.partition("=")
        if setting_values.get(key) is not None:
            message = f"--set {setting} cannot be combined with the option for {key}: give one"
            raise UsageError(message)
        is_off = text.lower() in _OFF_VALUES
        if format_version == "1.0" and key in _UNSUPPORTED_IN_1_0 and not is_off:
            reject_conflicts("--format 1.0", {f"--set {setting}": True})
    if format_version == "1.0":
        has_snapshot_interval = setting_values["canonical.snapshot_interval"] is not None
        reject_conflicts("--format 1.0", {"--snapshot-interval": has_snapshot_interval})
    version_settings = [f"{key}=0" for key in _UNSUPPORTED_IN_1_0 if format_version == "1.0"]
    return make_config(
        preset, [*(settings or []), *format_settings(setting_values), *version_settings], seed=0
    )


def _print_result(
    output: Path, findings: FindingCollector, seconds: float, *, as_json: bool
) -> None:
    """Print the sizes of the stream, the findings and the time of the encode."""
    from quarc_ref.inspection.inspect_stream import inspect_stream

    try:
        summary = inspect_stream(output.read_bytes())
    except KeyboardInterrupt as error:
        message = f"interrupted; {output} is complete"
        raise KeyboardInterrupt(message) from error
    rounded_seconds = round(seconds, 1)
    if as_json:
        encode_values = {"findings": findings.as_json(), "seconds": rounded_seconds}
        print_json("encode/3", {"file": str(output), **summary.as_json(), **encode_values})
    else:
        print_fields(output.name, describe_stream(summary) | {"seconds": f"{rounded_seconds}"})
