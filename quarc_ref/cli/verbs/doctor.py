"""The `doctor` command: finds problems in a capture before a long encode."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.completion import complete_preset
from quarc_ref.cli.encode_arguments import HeldOut
from quarc_ref.cli.encoder_options import make_config, name_capture_options, require_device
from quarc_ref.cli.errors import report_errors
from quarc_ref.cli.options import AsJson, CaptureFolder, Quiet
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json, print_message

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Capture
    from quarc_ref.datasets.capture_notes import CaptureNotes
    from quarc_ref.datasets.open_capture import CaptureOptions
    from quarc_ref.encoder.doctor import Diagnosis

_EXIT_FINDINGS = 1
_PIXEL_DESCRIPTIONS = {
    "all": "all are used for training",
    "unmasked": "only those that masks leave are used",
    "subject": "only those of the subject are used: transparent background",
}
_UNITS = ("B", "KB", "MB", "GB", "TB")
_MAX_COUNT = 999.5  # of a unit; with three digits, larger numbers would have an exponent


def doctor(
    capture: CaptureFolder,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Check only the files and the first frame, as encode does."),
    ] = False,
    start: Annotated[
        int, typer.Option("--start", min=0, help="First frame of the capture to check.")
    ] = 0,
    frames: Annotated[
        int | None,
        typer.Option("--frames", min=1, help="Number of frames to check.", show_default="all"),
    ] = None,
    downscale: Annotated[
        int, typer.Option("--downscale", min=1, help="Downscale the pictures by this factor.")
    ] = 1,
    held_out: HeldOut = None,
    preset: Annotated[
        str,
        typer.Option(
            "--preset",
            help="Preset for which time and size are forecast; demo is the fastest.",
            autocompletion=complete_preset,
        ),
    ] = "main",
    device: Annotated[
        Literal["auto", "cpu", "cuda"],
        typer.Option("--device", help="Device for which the time is forecast."),
    ] = "auto",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find problems in a capture, and forecast the time, memory and disk space of its encode."""
    with report_errors():
        from quarc_ref.datasets.open_capture import CaptureOptions
        from quarc_ref.encoder.doctor import ExamineOptions, examine

        require_device(device)
        capture_options = CaptureOptions(downscale, tuple(held_out or ()), frames, start)
        config = make_config(preset, [], 0)
        with (
            TerminalProgress(quiet=quiet) as progress,
            name_capture_options(capture_options, frames),
        ):
            diagnosis = examine(
                capture, ExamineOptions(capture_options, quick, config, device, progress)
            )
        if as_json:
            document = _as_json(capture, diagnosis, capture_options, quick=quick, preset=preset)
            print_json("doctor/3", document)
        else:
            print_fields(capture.resolve().name, _describe_diagnosis(diagnosis, preset))
        for finding in () if as_json else diagnosis.findings:
            print_message(f"{finding.kind}: {finding.message}")
        if diagnosis.findings:
            raise typer.Exit(_EXIT_FINDINGS)


def _describe_diagnosis(diagnosis: "Diagnosis", preset: str) -> dict[str, str]:
    """Format the properties of a capture and the forecast for its encode as rows of a table."""
    rows = {"layout": diagnosis.layout or "unknown"}
    if diagnosis.capture is not None:
        rows |= _describe_capture(diagnosis.capture)
    if diagnosis.forecast is not None:
        forecast = diagnosis.forecast
        low, high = forecast.stream_bytes
        rows |= {
            f"encoding time ({preset})": f"{_format_duration(forecast.seconds)}: "
            f"{_format_duration(forecast.seconds_of_first)} for frame 0, "
            f"{_format_duration(forecast.seconds_per_frame)} for each later frame",
            "memory": f"{_format_bytes(forecast.memory_bytes)}"
            + (
                f" of {_format_bytes(free_memory)} free"
                if (free_memory := diagnosis.machine.memory_bytes)
                else ""
            ),
            "disk": f"{_format_bytes(forecast.disk_bytes)} of "
            f"{_format_bytes(diagnosis.machine.disk_bytes)} free",
            "stream": f"{_format_bytes(low)} to {_format_bytes(high)}",
        }
    count = len(diagnosis.findings)
    rows["findings"] = "none" if not count else f"{count}, listed on standard error"
    return rows


def _describe_capture(capture: "Capture") -> dict[str, str]:
    sizes = sorted({(camera.width, camera.height) for camera in capture.cameras})
    held_out = [capture.cameras[index].name for index in capture.held_out]
    return {
        "cameras": f"{len(capture.cameras)}; held out: {', '.join(held_out)}",
        "pictures": ", ".join(f"{width} x {height}" for width, height in sizes),
        "frames": f"{capture.frame_count}, {capture.frames_per_second:g} per second",
        "initial points": f"{len(capture.points.positions)}",
        "world": _describe_world(capture.notes),
        "pixels": _PIXEL_DESCRIPTIONS[_name_used_pixels(capture)],
    }


def _describe_world(notes: "CaptureNotes") -> str:
    """Format the up direction and the scale of the world."""
    up = "unknown" if notes.up is None else ", ".join(f"{number:.3g}" for number in notes.up)
    scale = "unknown" if notes.meters_per_unit is None else f"{notes.meters_per_unit:g}"
    return f"up: {up}; meters per unit: {scale}"


def _name_used_pixels(capture: "Capture") -> str:
    """Return which pixels of the pictures are used, a key of `_PIXEL_DESCRIPTIONS`."""
    if capture.alphas is not None:
        return "subject"
    return "all" if capture.masks is None else "unmasked"


def _as_json(
    folder: Path,
    diagnosis: "Diagnosis",
    capture_options: "CaptureOptions",
    *,
    quick: bool,
    preset: str,
) -> dict[str, object]:
    """Return a diagnosis in the form that `docs/schemas/doctor.json` describes."""
    capture, forecast = diagnosis.capture, diagnosis.forecast
    return {
        "folder": str(folder),
        "layout": diagnosis.layout,
        "quick": quick,
        "start": capture_options.start,
        "capture": None
        if capture is None
        else {
            "cameras": [
                {
                    "name": camera.name,
                    "width": camera.width,
                    "height": camera.height,
                    "held_out": camera.held_out,
                }
                for camera in capture.cameras
            ],
            "frames": capture.frame_count,
            "frames_per_second": capture.frames_per_second,
            "points": len(capture.points.positions),
            "up": capture.notes.up,
            "meters_per_unit": capture.notes.meters_per_unit,
            "used_pixels": _name_used_pixels(capture),
        },
        "forecast": None if forecast is None else {"preset": preset, **asdict(forecast)},
        "machine": asdict(diagnosis.machine),
        "findings": [asdict(finding) for finding in diagnosis.findings],
    }


def _format_duration(seconds: float) -> str:
    """Format a duration, given in seconds, in s, min or h."""
    if seconds < 90:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h"


def _format_bytes(count: float) -> str:
    """Format a number of bytes with a unit from B to TB; a KB is 1024 bytes."""
    for unit in _UNITS[:-1]:
        if count < _MAX_COUNT:
            return f"{count:.3g} {unit}"
        count /= 1024
    return f"{count:.3g} {_UNITS[-1]}"
