"""Converts and checks options of `encode`, `demo` and `doctor` before work starts."""

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.errors import UsageError

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Capture
    from quarc_ref.datasets.open_capture import CaptureOptions
    from quarc_ref.encoder.settings.config import EncoderConfig


def make_config(preset: str, settings: list[str], seed: int) -> "EncoderConfig":
    """Return the settings of a preset, with a seed and with changes given as `KEY=VALUE`.

    Raises:
        UsageError: The preset or a setting does not exist, or a value is not allowed.
    """
    from quarc_ref.encoder.settings.presets import SettingError, change_settings, choose_preset

    changes = [("seed", str(seed))]
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            message = f"--set takes KEY=VALUE, such as motion.lr=5e-4, not {setting!r}"
            raise UsageError(message)
        changes.append((key, value))
    try:
        return change_settings(choose_preset(preset), changes)
    except SettingError as error:
        raise UsageError(str(error)) from error


def require_positive(values: dict[str, float | None]) -> None:
    """Raise UsageError if a given option is not a number above 0."""
    for option, value in values.items():
        if value is not None and not 0 < value < math.inf:
            message = f"{option} takes a number above 0, not {value}"
            raise UsageError(message)


def require_quality(quality: float | None) -> None:
    """Raise UsageError if `--quality` is given and is not a number from 0 to 100."""
    if quality is not None and not 0 <= quality <= 100:
        message = f"--quality takes a number from 0 to 100, not {quality}"
        raise UsageError(message)


def format_settings(values: dict[str, float | None]) -> list[str]:
    """Return `KEY=VALUE` texts of the encoder settings that are not None."""
    return [f"{key}={value}" for key, value in values.items() if value is not None]


def print_settings() -> None:
    """Print all settings, with their values in every preset."""
    from quarc_ref.encoder.settings.presets import PRESETS
    from quarc_ref.encoder.settings.setting_list import describe_settings

    setting_variants = zip(*map(describe_settings, PRESETS.values()), strict=True)
    rows = [("KEY", *(f"in {name}" for name in PRESETS), "values", "description")]
    rows += [
        (
            first_setting.name,
            first_setting.text,
            *(setting.text for setting in other_settings),
            first_setting.values,
            first_setting.description,
        )
        for first_setting, *other_settings in setting_variants
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    # The last column is not padded, because a terminal would wrap trailing spaces.
    for *cells, description in rows:
        padded_cells = [f"{cell:<{width}}" for cell, width in zip(cells, widths, strict=False)]
        sys.stdout.write("  ".join([*padded_cells, description]) + "\n")


def require_device(device: str) -> None:
    """Raise UsageError if the requested device is not available."""
    import torch

    if device == "cuda" and not torch.cuda.is_available():
        message = "--device cuda: torch finds no CUDA device; use auto to fall back to the CPU"
        raise UsageError(message)


def open_requested_capture(folder: Path, options: "CaptureOptions") -> "Capture":
    """Open a capture with options from the command line.

    Raises:
        UsageError: The pictures cannot be downscaled by the factor, a camera to hold out does not
            exist, or the start frame is after the last frame.
        CaptureError: The capture cannot be read.
        UnicodeEncodeError: The name of a file, the capture or a camera is not valid UTF-8.
    """
    from quarc_ref.datasets.calibration import DownscaleError
    from quarc_ref.datasets.errors import HeldOutError, StartError
    from quarc_ref.datasets.open_capture import open_capture

    try:
        capture = open_capture(folder, options)
    except HeldOutError as error:
        message = f"--held-out: {error}"
        raise UsageError(message) from error
    except DownscaleError as error:
        message = f"--downscale {options.downscale}: {error}"
        raise UsageError(message) from error
    except StartError as error:
        message = f"--start {options.start}: {error}"
        raise UsageError(message) from error
    for name in (capture.name, *(camera.name for camera in capture.cameras)):
        name.encode()  # raises UnicodeEncodeError now, rather than after training
    return capture
