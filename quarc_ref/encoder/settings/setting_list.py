"""All settings that there are, with what they take and mean: what `--list-settings` prints."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any, get_type_hints

from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.settings.ranges import name_values

_ATTRIBUTE = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class ExplainedSetting:
    """A leaf of a tree of settings.

    Attributes:
        name: Its path, such as `motion.rate`.
        text: Its value, as `change_setting` takes it.
        takes: What values it takes, in words.
        meaning: What it is.
    """

    name: str
    text: str
    takes: str
    meaning: str


def explain_settings(config: EncoderConfig) -> Iterator[ExplainedSetting]:
    """Yield every leaf of the settings, in their order."""
    for path, value in list_settings(config):
        *groups, name = path.split(".")
        kind = type(reduce(getattr, groups, config))
        takes = name_values(get_type_hints(kind, include_extras=True)[name])
        yield ExplainedSetting(path, _write_value(value), takes, _read_meanings(kind).get(name, ""))


def _read_meanings(kind: type) -> dict[str, str]:
    """Return what a docstring says of attributes; nothing where Python left docstrings out."""
    _, _, attributes = (inspect.getdoc(kind) or "").partition("\nAttributes:\n")
    return {name: " ".join(text.split()) for name, text in _ATTRIBUTE.findall(attributes)}


def _write_value(value: Any) -> str:  # noqa: ANN401
    if isinstance(value, tuple):
        return ",".join(map(str, value))
    return str(value).lower() if isinstance(value, bool) else str(value)
