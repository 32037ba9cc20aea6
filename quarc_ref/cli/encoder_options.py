"""Converts and checks options of `encode`, `demo` and `doctor` before work starts."""

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from quarc_ref.cli.errors import UsageError

if TYPE_CHECKING:
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


@contextmanager
def name_capture_options(options: "CaptureOptions", frame_count: int | None) -> Iterator[None]:
    """Name the option in errors about options of a capture; these become UsageErrors.

    Args:
        options: Options with which the capture is opened in the `with` block.
        frame_count: Value of `--frames`; None for all frames.
    """
    from quarc_ref.datasets.calibration import DownscaleError
    from quarc_ref.datasets.errors import HeldOutError, StartError, TooFewFramesError

    option_by_error: dict[type[Exception], str] = {
        HeldOutError: "--held-out",
        StartError: f"--start {options.start}",
        TooFewFramesError: f"--frames {frame_count}",
        DownscaleError: f"--downscale {options.downscale}",
    }
    try:
        yield
    except tuple(option_by_error) as error:
        message = f"{option_by_error[type(error)]}: {error}"
        raise UsageError(message) from error
