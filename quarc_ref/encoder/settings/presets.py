"""Named trees of settings, and changes to single leaves by name.

`main` is the best that was measured, bytes against PSNR (benchmarks/README.md).
`demo` fits the built-in capture into a few minutes of two cores, and holds its
quality at several times the bytes. `paper` is the paper's schedule to the
letter, where it states one, and its steps: all of them 0.01 but that of positions.
"""

import difflib
import struct
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from quarc_ref.encoder.settings.config import (
    BirthSettings,
    CanonicalSettings,
    EncoderConfig,
    MotionSettings,
    StepSettings,
)
from quarc_ref.encoder.settings.ranges import name_values
from quarc_ref.format.records import StreamHeader

_PAPER_STEP = struct.unpack("<f", struct.pack("<f", 0.01))[0]
_PAPER = EncoderConfig(
    stream=StreamHeader(
        rotation_components=4,
        gaussians_per_anchor=4,
        resample_interval=2,
        rotation_bits=7,
        log_scale_step=_PAPER_STEP,
        opacity_step=_PAPER_STEP,
        sh_dc_step=_PAPER_STEP,
        sh_rest_step=_PAPER_STEP,
    ),
    canonical=CanonicalSettings(quantize_from=1.0),
)
_MAIN = EncoderConfig(
    stream=StreamHeader(
        gaussians_per_anchor=2,
        resample_interval=1,
        rotation_unity=32,
        rotation_bits=6,
        log_scale_step=1 / 8,
        opacity_step=1 / 4,
        sh_dc_step=1 / 16,
        sh_rest_step=1 / 16,
        updates=True,
    ),
    steps=StepSettings(position_pixels=0.2, translation_change=0.0024),
    canonical=CanonicalSettings(
        iterations=4000,
        initial_gaussians=20_000,
        max_gaussians=40_000,
        sh_from=3600,
        densify_from=300,
        densify_until=2700,
        noise=0.0,
        axis_noise=0.6,
        keep_opacity=0.016,
        halved_until=2300,
        exposure_rate=0.2,
        exposure_from=100,
        opacity_decay=0.001,
        quantize_from=0.9,
        gaussian_price=1.0,
        code_price=0.02,
        rate_end=0.05,
    ),
    motion=MotionSettings(
        iterations=260,
        rate=1e-3,
        step_rate=0.15,
        level_rate=2.0,
        rate_end=0.05,
        price="group_log",
        price_weight=0.7,
        warm_start="projection",
        momentum=1.0,
    ),
    births=BirthSettings(
        iterations=40,
        placement="errors",
        error=0.06,
        deaths_below=0.05,
        max_births=300,
        rate_factor=10.0,
        rate_end=0.05,
        split_at=(),
        must_pay=True,
        byte_price=0.04,
    ),
)
_DEMO = replace(
    _MAIN,
    stream=StreamHeader(gaussians_per_anchor=4, resample_interval=1, updates=True),
    steps=StepSettings(),
    canonical=replace(
        _MAIN.canonical,
        iterations=1000,
        initial_gaussians=8000,
        max_gaussians=20_000,
        sh_from=800,
        densify_until=750,
        keep_opacity=0.005,
        halved_until=0,
        exposure_rate=0.0,
        quantize_from=0.8,
        rate_end=1.0,
    ),
    motion=replace(_MAIN.motion, iterations=180, step_rate=0.0, price_weight=0.04),
    births=replace(_MAIN.births, iterations=60, error=0.04, max_births=800, byte_price=0.0),
)
PRESETS = {"main": _MAIN, "demo": _DEMO, "paper": _PAPER}


class SettingError(ValueError):
    """A setting that does not exist, or a value that it does not take."""


def choose_preset(name: str) -> EncoderConfig:
    """Return a preset.

    Raises:
        SettingError: There is no such preset.
    """
    if name not in PRESETS:
        message = f"no preset {name!r}; there are {', '.join(PRESETS)}"
        raise SettingError(message)
    return PRESETS[name]


def change_setting(config: EncoderConfig, path: str, text: str) -> EncoderConfig:
    """Return the settings with one leaf changed.

    Args:
        config: Settings.
        path: Name of a leaf, such as `motion.rate`.
        text: Its new value; a tuple's items are separated by commas.

    Raises:
        SettingError: No such leaf, or no such value.
    """
    names = dict(list_settings(config))
    if path not in names:
        last = [name for name in names if name.endswith(f".{path}")]
        close = last or difflib.get_close_matches(path, names, n=3)
        hint = f"; close to it: {', '.join(close)}" if close else ""
        message = f"no setting {path!r}{hint}; encode --list-settings prints all there are"
        raise SettingError(message)
    changed: EncoderConfig = _changed(config, path.split("."), path, text)
    return changed


def list_settings(config: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:  # noqa: ANN401
    """Yield the path and the value of every leaf."""
    for field in fields(config):
        value = getattr(config, field.name)
        path = prefix + field.name
        if is_dataclass(value):
            yield from list_settings(value, path + ".")
        else:
            yield path, value


def _changed(node: Any, names: list[str], path: str, text: str) -> Any:  # noqa: ANN401
    name, *rest = names
    if rest:
        return replace(node, **{name: _changed(getattr(node, name), rest, path, text)})
    hint = get_type_hints(type(node), include_extras=True)[name]
    try:
        value = _parse_value(hint, text)
    except (KeyError, ValueError) as error:
        message = f"{path}={text}: it takes {name_values(hint)}"
        raise SettingError(message) from error
    try:
        return replace(node, **{name: value})
    except ValueError as error:
        message = f"{path}={text}: {error}"
        raise SettingError(message) from error


def _parse_value(hint: Any, text: str) -> Any:  # noqa: ANN401
    """Return the value that a text stands for; raise KeyError or ValueError if there is none."""
    kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    if kind is bool:
        return _BOOLEANS[text.lower()]
    if get_origin(kind) is tuple:
        return tuple(int(item) for item in text.split(",") if item)
    if get_origin(kind) is Literal:
        return get_args(kind)[get_args(kind).index(text)]
    return kind(text)


_BOOLEANS = {"true": True, "false": False, "yes": True, "no": False, "1": True, "0": False}
