"""Presets (named sets of settings), and functions that list and change single settings.

`main` has the best measured trade-off between bytes and PSNR (benchmarks/README.md).
`demo` encodes the playroom in a few minutes on two cores, with the same quality as
`main` but several times the bytes. `paper` has the training schedule and the quantization
steps of the QuARC-GS paper; all these steps except the position step are 0.01.
"""

import difflib
import struct
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import (
    FIXED_SETTINGS,
    EncoderConfig,
    StepSettings,
    find_replacement,
)
from quarc_ref.encoder.settings.frames import BirthSettings, MotionSettings
from quarc_ref.encoder.settings.ranges import describe_values
from quarc_ref.encoder.settings.renamed import RENAMED
from quarc_ref.format.records import StreamHeader


def _round_to_binary32(number: float) -> float:
    """Round a number as HEAD stores it; numbers that are too large are not rounded."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", number))[0])
    except OverflowError:
        return number


_PAPER_STEP = _round_to_binary32(0.01)
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
        sh_degree=0,
        updates=True,
    ),
    steps=StepSettings(position_pixels=0.2, translation_change=0.0036, translation_error=0.25),
    canonical=CanonicalSettings(
        iterations=4000,
        initial_gaussians=20_000,
        max_gaussians=40_000,
        max_gaussians_from_views=12,
        sh_from_iter=2400,  # with stream.sh_degree=1
        sh_rest_lr=5e-4,
        lambda_dssim=0.4,
        densify_from_iter=300,
        densify_until_iter=2700,
        position_noise=0.0,
        axis_noise=0.6,
        final_prune_opacity=0.016,
        half_resolution_until_iter=2300,
        ensemble_size=3,
        ensemble_from_views=12,
        pseudo_views_from=0.375,
        pseudo_view_ratio=0.5,
        exposure_lr=0.2,
        exposure_from_iter=100,
        opacity_decay=0.001,
        quantize_from=0.9,
        prune_rd_lambda=0.6,
        code_rd_lambda=0.0025,
        quantize_rd_lambda=0.006,
        lr_end_factor=0.05,
    ),
    motion=MotionSettings(
        iterations=260,
        lr=1e-3,
        translation_lr=0.15,
        level_lr_factor=2.0,
        lr_end_factor=0.05,
        rate_model="group_log",
        rd_lambda=0.735,
        warm_start="projection",
        momentum=1.0,
        follow_exposures=True,
    ),
    births=BirthSettings(
        iterations=40,
        placement="errors",
        error_threshold=0.06,
        death_opacity=0.05,
        max_births=300,
        lr_factor=10.0,
        lr_end_factor=0.05,
        split_iters=(),
        rd_selection=True,
        rd_lambda=0.042,
    ),
)
_DEMO = replace(
    _MAIN,
    stream=StreamHeader(gaussians_per_anchor=4, resample_interval=1, sh_degree=0, updates=True),
    steps=StepSettings(),
    canonical=replace(
        _MAIN.canonical,
        iterations=1000,
        initial_gaussians=8000,
        max_gaussians=20_000,
        sh_from_iter=600,
        densify_until_iter=750,
        final_prune_opacity=0.005,
        half_resolution_until_iter=0,
        ensemble_size=1,
        exposure_lr=0.0,
        quantize_from=0.8,
        prune_rd_lambda=1.5,
        lr_end_factor=1.0,
    ),
    motion=replace(_MAIN.motion, iterations=180, translation_lr=0.0, rd_lambda=0.04),
    births=replace(
        _MAIN.births, iterations=60, error_threshold=0.04, max_births=800, rd_lambda=0.0
    ),
)
PRESETS = {"main": _MAIN, "demo": _DEMO, "paper": _PAPER}


class SettingError(ValueError):
    """A preset or setting does not exist, or a value is invalid."""


def choose_preset(name: str) -> EncoderConfig:
    """Return the settings of a preset.

    Raises:
        SettingError: The preset does not exist.
    """
    if name not in PRESETS:
        message = f"there is no preset {name!r}; the presets are {', '.join(PRESETS)}"
        raise SettingError(message)
    return PRESETS[name]


def change_setting(config: EncoderConfig, path: str, text: str) -> EncoderConfig:
    """Return a copy of the settings with one of them changed.

    Args:
        config: All settings.
        path: Name of the setting to change, such as `motion.lr`.
        text: New value as text; the items of a tuple are separated by commas.

    Raises:
        SettingError: The setting does not exist, the value is invalid, or the encoder sets it.
    """
    if path in RENAMED:
        message = f"setting {path!r} is now {RENAMED[path]!r}"
        raise SettingError(message)
    if path in FIXED_SETTINGS:
        message = f"{path} cannot be set: {FIXED_SETTINGS[path]} determines it"
        raise SettingError(message)
    names = dict(list_settings(config))
    if path not in names:
        same_names = [name for name in names if name.endswith(f".{path}")]
        similar_names = same_names or difflib.get_close_matches(path, names, n=3)
        suggestion = f"; similar names: {', '.join(similar_names)}" if similar_names else ""
        message = (
            f"there is no setting {path!r}{suggestion}; encode --list-settings lists all settings"
        )
        raise SettingError(message)
    new_config: EncoderConfig = _replace_setting(config, path.split("."), path, text)
    return new_config


def change_settings(config: EncoderConfig, changes: Iterable[tuple[str, str]]) -> EncoderConfig:
    """Return a copy of the settings with several of them changed, each of which has an effect.

    Args:
        config: All settings.
        changes: Name and new value of each setting, as for `change_setting`.

    Raises:
        SettingError: A setting does not exist, its value is invalid, or it would have no effect,
            because another setting determines the value.
    """
    paths = []
    for path, text in changes:
        config = change_setting(config, path, text)
        paths.append(path)
    for path in paths:
        replacement = find_replacement(config, path)
        if replacement:
            message = f"{path} has no effect, because {replacement} is not 0: set {replacement}"
            raise SettingError(message)
    return config


def list_settings(config: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:  # noqa: ANN401
    """Yield the name and the value of every setting."""
    for field in fields(config):
        value = getattr(config, field.name)
        path = prefix + field.name
        if is_dataclass(value):
            yield from list_settings(value, path + ".")
        else:
            yield path, value


def _replace_setting(settings: Any, names: list[str], path: str, text: str) -> Any:  # noqa: ANN401
    name, *remaining_names = names
    if remaining_names:
        return replace(
            settings,
            **{name: _replace_setting(getattr(settings, name), remaining_names, path, text)},
        )
    type_hint = get_type_hints(type(settings), include_extras=True)[name]
    try:
        value = _parse_value(type_hint, text)
        if isinstance(settings, StreamHeader) and isinstance(value, float):
            value = _round_to_binary32(value)
    except (KeyError, ValueError) as error:
        message = f"{path} takes {describe_values(type_hint)}, not {text!r}"
        raise SettingError(message) from error
    try:
        return replace(settings, **{name: value})
    except ValueError as error:
        message = f"{path}={text}: {error}"
        raise SettingError(message) from error


def _parse_value(type_hint: Any, text: str) -> Any:  # noqa: ANN401
    """Parse text as a value of a type; raise KeyError or ValueError if the text is invalid."""
    value_type = get_args(type_hint)[0] if get_origin(type_hint) is Annotated else type_hint
    if value_type is bool:
        return _BOOLEANS[text.lower()]
    if get_origin(value_type) is tuple:
        return tuple(int(item) for item in text.split(",") if item)
    if get_origin(value_type) is Literal:
        return get_args(value_type)[get_args(value_type).index(text)]
    return value_type(text)


_BOOLEANS = {"true": True, "false": False, "yes": True, "no": False, "1": True, "0": False}
