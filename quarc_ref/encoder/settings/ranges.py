"""Numbers that carry their bounds in their types, so that a wrong setting is told at once.

@dataclass(frozen=True, slots=True)
class Settings(Checked):
    iterations: Count = 100
"""

import sys
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

_MANY = 1 << 40  # more than anybody wants of anything that is counted


class Bounds(NamedTuple):
    """What a number may be, both ends included."""

    least: float
    most: float

    def __str__(self) -> str:
        if self.most not in (_MANY, sys.float_info.max):
            return f"from {self.least} to {self.most}"
        return "above 0" if self.least == sys.float_info.min else f"from {self.least} on"


Count = Annotated[int, Bounds(0, _MANY)]
Some = Annotated[int, Bounds(1, _MANY)]
Seed = Annotated[int, Bounds(0, (1 << 64) - 1)]
Amount = Annotated[float, Bounds(0, sys.float_info.max)]
Positive = Annotated[float, Bounds(sys.float_info.min, sys.float_info.max)]
Logit = Annotated[float, Bounds(-20, 20)]
Share = Annotated[float, Bounds(0, 1)]
Quality = Annotated[float, Bounds(0, 100)]


@dataclass(frozen=True, slots=True)
class Checked:
    """A dataclass whose numbers are within the bounds of their types.

    Raises:
        ValueError: One is not, when the dataclass is made.
    """

    def __post_init__(self) -> None:
        hints = get_type_hints(type(self), include_extras=True)
        for field in fields(self):
            hint, value = hints[field.name], getattr(self, field.name)
            for bounds in getattr(hint, "__metadata__", ()):
                if not bounds.least <= value <= bounds.most:
                    message = f"{field.name} takes {name_values(hint)}; this is {value!r}"
                    raise ValueError(message)


def name_values(hint: Any) -> str:  # noqa: ANN401
    """Return what a setting takes, in words.

    Args:
        hint: Its type, with the bounds of a number where it has some.
    """
    kind, *bounds = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    if get_origin(kind) is tuple:
        return "whole numbers with commas between them"
    if get_origin(kind) is Literal:
        return ", ".join(get_args(kind))
    return " ".join([_KINDS[kind], *map(str, bounds)])


_KINDS = {bool: "true, false", int: "a whole number", float: "a number"}
