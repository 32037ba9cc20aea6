"""Dataclass fields that have a description in their metadata."""

from dataclasses import Field, field
from typing import Any

_DESCRIPTION_KEY = "description"


def described(default: Any, description: str) -> Any:  # noqa: ANN401
    """Define a dataclass field with a default and a description.

    Args:
        default: The field's default value.
        description: One or more sentences; `describe_field` returns them.
    """
    return field(default=default, metadata={_DESCRIPTION_KEY: description})


def describe_field(dataclass_field: "Field[Any]") -> str:
    """Return the description of a field, or an empty string if it has none."""
    return str(dataclass_field.metadata.get(_DESCRIPTION_KEY, ""))
