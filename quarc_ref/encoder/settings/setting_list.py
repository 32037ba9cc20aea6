"""Lists every setting with its value, valid values and description, for `--list-settings`."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import reduce
from typing import Any, get_type_hints

from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.settings.ranges import describe_values
from quarc_ref.format.described import describe_field


@dataclass(frozen=True, slots=True)
class DescribedSetting:
    """A setting and its description.

    Attributes:
        name: Name, such as `motion.lr`.
        text: Value in the form that `change_setting` accepts.
        values: Description of the valid values.
        description: Meaning of the setting.
    """

    name: str
    text: str
    values: str
    description: str


def describe_settings(config: EncoderConfig) -> Iterator[DescribedSetting]:
    """Yield every setting, in the order of the fields."""
    for path, value in list_settings(config):
        *groups, name = path.split(".")
        kind = type(reduce(getattr, groups, config))
        values = describe_values(get_type_hints(kind, include_extras=True)[name])
        descriptions = {each.name: describe_field(each) for each in fields(kind)}
        yield DescribedSetting(path, _write_value(value), values, descriptions[name])


def _write_value(value: Any) -> str:  # noqa: ANN401
    if isinstance(value, tuple):
        return ",".join(map(str, value))
    return str(value).lower() if isinstance(value, bool) else str(value)
