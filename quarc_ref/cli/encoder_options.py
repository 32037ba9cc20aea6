"""What the options of `encode` and `demo` ask of the encoder, proved before work begins."""

from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.faults import UsageError, regain_signals

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Capture
    from quarc_ref.encoder.config import EncoderConfig


def configure(preset: str, settings: list[str], seed: int) -> "EncoderConfig":
    """Return a preset with settings changed.

    Raises:
        UsageError: No such preset, setting or value.
    """
    from quarc_ref.encoder.presets import SettingError, change_setting, choose_preset

    try:
        config = change_setting(choose_preset(preset), "seed", str(seed))
        for setting in settings:
            key, equals, value = setting.partition("=")
            if not equals:
                message = f"--set takes KEY=VALUE, such as motion.rate=5e-4; this is {setting!r}"
                raise UsageError(message)
            config = change_setting(config, key, value)
    except SettingError as error:
        raise UsageError(str(error)) from error
    return config


def name_settings(asked: dict[str, float | None]) -> list[str]:
    """Return options that are settings under names of their own as `KEY=VALUE`."""
    return [f"{key}={value}" for key, value in asked.items() if value is not None]


def require_device(device: str) -> None:
    """Raise UsageError if a device is asked for that is not there."""
    import torch

    if device == "cuda" and not torch.cuda.is_available():
        message = "--device cuda: torch finds no CUDA device; auto takes the CPU then"
        raise UsageError(message)


def open_asked(folder: Path, downscale: int, held_out: list[str]) -> "Capture":
    """Open a capture at the size asked for.

    Raises:
        UsageError: The pictures cannot be made as small, or a camera that is to
            be held out is not there.
        CaptureError: The capture cannot be read.
    """
    from quarc_ref.datasets.errors import HeldOutError
    from quarc_ref.datasets.open_capture import CaptureOptions, open_capture

    regain_signals()
    try:
        return open_capture(folder, CaptureOptions(downscale, tuple(held_out)))
    except HeldOutError as error:
        message = f"--held-out: {error}"
        raise UsageError(message) from error
    except ValueError as error:
        message = f"--downscale {downscale}: {error}"
        raise UsageError(message) from error
