"""Metadata that describes how a stream was made.

`--resume` compares the metadata of a partial stream with that of the new encode.
"""

from importlib.metadata import version
from typing import Any

from quarc_ref import __version__
from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.world_frame import describe_up
from quarc_ref.rendering.backends import choose_device, choose_rasterizer


def describe_encode(capture: Capture, config: EncoderConfig, device: str) -> dict[str, str]:
    """Return the metadata of a stream: capture, settings and software.

    Only settings that differ from the defaults of `EncoderConfig` are included, because a list
    of all settings would take more bytes than a frame.

    Args:
        capture: The capture to encode.
        config: All settings.
        device: Device, as in `EncodeOptions`.
    """
    renderer = choose_rasterizer(choose_device(device)).name
    libraries = ", ".join(f"{name} {version(name)}" for name in sorted({"torch", renderer}))
    start_entry = {"start": str(capture.start)} if capture.start else {}
    background_entry = {"background": "transparent"} if capture.alphas else {}
    return {
        "capture": capture.name,
        "fingerprint": capture.fingerprint,
        **start_entry,
        **describe_up(capture.notes),
        **background_entry,
        "encoder": f"quarc-ref {__version__}, {libraries}",
        "settings": " ".join(f"{name}={value}" for name, value in _list_changed_settings(config)),
    }


def _list_changed_settings(config: EncoderConfig) -> list[tuple[str, Any]]:
    defaults = dict(list_settings(EncoderConfig()))
    return [(name, value) for name, value in list_settings(config) if value != defaults[name]]
