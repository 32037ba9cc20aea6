"""Finds faults in a capture before hours are spent on encoding it.

`encode` runs only the quick checks (`checks.capture_checks`). The functions of this module also
check all frames of all cameras, including held-out cameras. If the capture cannot be opened, the
error is reported as a finding.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.errors import CaptureError, HeldOutError, StartError
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.layouts.table import choose_layout
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.checks.blank_pictures import (
    COVERED,
    find_blank_frames,
    ignore_blank_frames,
)
from quarc_ref.encoder.checks.capture_checks import check_capture
from quarc_ref.encoder.checks.epipolar import find_wrong_poses
from quarc_ref.encoder.checks.exposure_changes import find_exposure_changes
from quarc_ref.encoder.checks.interlacing import find_interlaced_videos
from quarc_ref.encoder.checks.machine import (
    FreeResources,
    find_shortages,
    measure_free_resources,
)
from quarc_ref.encoder.checks.motion_checks import find_motion_faults
from quarc_ref.encoder.checks.moved_cameras import find_moved_cameras
from quarc_ref.encoder.checks.recording import find_unreadable, read_recordings
from quarc_ref.encoder.forecast import Forecast, forecast
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import choose_preset
from quarc_ref.format.errors import UnusableCaptureError


@dataclass(frozen=True, slots=True)
class ExamineOptions:
    """Options for examining a capture.

    Attributes:
        capture_options: Options of `open_capture`.
        quick: Whether to check only the files and frame 0, as `encode` does.
        config: Settings of the encode to forecast.
        device: Device, as in `EncodeOptions`.
        progress: Called after every step.
    """

    capture_options: CaptureOptions = field(default_factory=CaptureOptions)
    quick: bool = False
    config: EncoderConfig = field(default_factory=lambda: choose_preset("main"))
    device: str = "auto"
    progress: Progress = field(default_factory=NullProgress)


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """Results of examining a capture.

    Attributes:
        layout: Name of the layout; None if it is unknown.
        capture: The opened capture; None if it cannot be opened.
        forecast: Forecast of an encode; None if the capture cannot be encoded.
        machine: Free memory and disk space of this machine.
        findings: All faults that were found.
    """

    layout: str | None
    capture: Capture | None
    forecast: Forecast | None
    machine: FreeResources
    findings: tuple[Finding, ...]


def examine(folder: Path, options: ExamineOptions | None = None) -> Diagnosis:
    """Find the faults in a capture, and forecast the resources that its encode needs.

    Args:
        folder: Folder of the capture.
        options: Options of the examination; None for the defaults.

    Raises:
        HeldOutError: A camera to hold out does not exist.
        StartError: The requested first frame is after the last frame of the capture.
        TooFewFramesError: The capture has fewer frames than requested.
        DownscaleError: The pictures cannot be downscaled by the requested factor.
    """
    options, machine = options or ExamineOptions(), measure_free_resources()
    layout = None
    try:
        layout = choose_layout(folder).name
        capture = open_capture(folder, options.capture_options)
    except (HeldOutError, StartError):
        raise
    except CaptureError as error:
        return Diagnosis(layout, None, None, machine, (_to_finding(error),))
    capture.require_frames(options.capture_options.max_frames)
    findings = [*capture.findings]
    try:
        findings += check_capture(capture)
        if not options.quick:
            findings += _examine_frames(capture, options.progress)
        encode_forecast = forecast(capture, options.config, device=options.device)
    except (CaptureError, UnusableCaptureError) as error:
        findings.append(_to_finding(error))
        return Diagnosis(layout, capture, None, machine, _drop_repeated_findings(findings))
    findings += find_shortages(machine, encode_forecast.memory_bytes, encode_forecast.disk_bytes)
    return Diagnosis(layout, capture, encode_forecast, machine, _drop_repeated_findings(findings))


def _examine_frames(capture: Capture, progress: Progress) -> list[Finding]:
    """Return findings from all frames of all cameras."""
    names, start = [camera.name for camera in capture.cameras], capture.start
    recordings = read_recordings(capture, lambda *done: progress.advance("frames", *done))
    findings = [*find_unreadable(names, recordings, start), *find_interlaced_videos(capture)]
    # Where only a subject shows, its motion cannot be told from that of the camera.
    if capture.alphas is None:
        moved = list(find_moved_cameras(names, recordings, start))
        covered_names = {name for f in moved if f.kind == COVERED for name in f.cameras}
        blank = find_blank_frames(names, recordings, start)
        findings += [*moved, *(f for f in blank if covered_names.isdisjoint(f.cameras))]
        recordings = [ignore_blank_frames(recording) for recording in recordings]
    return [
        *findings,
        *find_exposure_changes(names, recordings),
        *find_motion_faults(capture.cameras, recordings, capture.notes.offsets, start),
        *find_wrong_poses(capture),
    ]


def _to_finding(error: Exception) -> Finding:
    """Convert an error to a finding whose kind is derived from the name of the error class."""
    words = re.findall("[A-Z][a-z]+", type(error).__name__.removesuffix("Error"))
    return Finding("-".join(words).lower(), str(error))


def _drop_repeated_findings(findings: list[Finding]) -> tuple[Finding, ...]:
    """Drop findings about cameras of which another finding says more.

    The check of colors says more than that of matches, and the check of all frames, which comes
    last, says more than that of frame 0 about what a camera does not show.
    """
    reported_cameras = {
        camera
        for finding in findings
        if finding.kind in _COLOR_CHECK_KINDS
        for camera in finding.cameras
    }
    last_covered = {finding.cameras: finding for finding in findings if finding.kind == COVERED}
    return tuple(
        finding
        for finding in findings
        if not (
            (finding.kind == "epipolar-error" and reported_cameras.issuperset(finding.cameras))
            or (finding.kind == COVERED and last_covered[finding.cameras] is not finding)
        )
    )


_COLOR_CHECK_KINDS = ("pose-disagrees", "poses-mixed-up")
