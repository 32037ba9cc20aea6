"""Numbers that carry their bounds in their types, so that a wrong setting is told at once.

@dataclass(frozen=True, slots=True)
class Settings(Checked):
    iterations: Count = 100
"""

import sys
from dataclasses import dataclass, fields
from typing import Annotated, Any, NamedTuple, get_type_hints


class Bounds(NamedTuple):
    """What a number may be, both ends included."""

    least: float
    most: float


Count = Annotated[int, Bounds(0, 1 << 40)]
Some = Annotated[int, Bounds(1, 1 << 40)]
Seed = Annotated[int, Bounds(0, (1 << 64) - 1)]
Amount = Annotated[float, Bounds(0, sys.float_info.max)]
Positive = Annotated[float, Bounds(sys.float_info.min, sys.float_info.max)]
Logit = Annotated[float, Bounds(-20, 20)]
Share = Annotated[float, Bounds(0, 1)]


@dataclass(frozen=True, slots=True)
class Checked:
    """A dataclass whose numbers are within the bounds of their types.

    Raises:
        ValueError: One is not, when the dataclass is made.
    """

    def __post_init__(self) -> None:
        hints = get_type_hints(type(self), include_extras=True)
        for field in fields(self):
            for bounds in getattr(hints[field.name], "__metadata__", ()):
                _check(field.name, getattr(self, field.name), bounds)


def _check(name: str, value: Any, bounds: Bounds) -> None:  # noqa: ANN401
    if not bounds.least <= value <= bounds.most:
        message = f"{name} takes {bounds.least:g} to {bounds.most:g}; this is {value!r}"
        raise ValueError(message)
