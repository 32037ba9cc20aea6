"""Lists every setting with its value, valid values and description (`--list-settings`)."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import reduce
from typing import Any, get_type_hints

import numpy as np

from quarc_ref.encoder.settings.config import FIXED_SETTINGS, EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.settings.ranges import describe_values
from quarc_ref.format.described import describe_field


@dataclass(frozen=True, slots=True)
class DescribedSetting:
    """A setting with its value and description, as text.

    Attributes:
        name: Full name, such as `motion.lr`.
        text: Current value in the form that `change_setting` accepts.
        values: Description of the valid values.
        description: Meaning of the setting.
    """

    name: str
    text: str
    values: str
    description: str


def describe_settings(config: EncoderConfig) -> Iterator[DescribedSetting]:
    """Yield a description of every setting that can be changed, in the order of the fields."""
    for path, value in list_settings(config):
        if path in FIXED_SETTINGS:
            continue
        *groups, name = path.split(".")
        settings_type = type(reduce(getattr, groups, config))
        values = describe_values(get_type_hints(settings_type, include_extras=True)[name])
        descriptions = {field.name: describe_field(field) for field in fields(settings_type)}
        if groups == ["stream"] and isinstance(value, float):
            value = np.float32(value)  # as HEAD stores it; the text is 0.01, not 0.00999999977...
        yield DescribedSetting(path, _format_value(value), values, descriptions[name])


def _format_value(value: Any) -> str:  # noqa: ANN401
    if isinstance(value, tuple):
        return ",".join(map(str, value))
    return str(value).lower() if isinstance(value, bool) else str(value)
