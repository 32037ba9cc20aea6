"""Number types with bounds that are checked when a settings dataclass is created.

@dataclass(frozen=True, slots=True)
class Settings(Validated):
    iterations: NonNegativeInt = 100
"""

import sys
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from quarc_ref.format.constants import LEVELS

_INT_LIMIT = 1 << 40  # above any useful count
_FLOAT_LIMIT = sys.float_info.max
_COUNT_LIMITS = LEVELS[30]  # the decoder declines frames with more Gaussians or births


class Bounds(NamedTuple):
    """Bounds of a number: the smallest and the largest valid value."""

    minimum: float
    maximum: float

    def __str__(self) -> str:
        if self.maximum not in (_INT_LIMIT, _FLOAT_LIMIT):
            if self.minimum == sys.float_info.min:
                return f"above 0 and at most {self.maximum}"
            return f"from {self.minimum} to {self.maximum}"
        return "above 0" if self.minimum == sys.float_info.min else f"of at least {self.minimum}"


NonNegativeInt = Annotated[int, Bounds(0, _INT_LIMIT)]
PositiveInt = Annotated[int, Bounds(1, _INT_LIMIT)]
GaussianCount = Annotated[int, Bounds(1, _COUNT_LIMITS.gaussians)]
BirthCount = Annotated[int, Bounds(0, _COUNT_LIMITS.births)]
Seed = Annotated[int, Bounds(0, (1 << 64) - 1)]
NonNegativeFloat = Annotated[float, Bounds(0, _FLOAT_LIMIT)]
PositiveFloat = Annotated[float, Bounds(sys.float_info.min, _FLOAT_LIMIT)]
Logit = Annotated[float, Bounds(-20, 20)]
UnitInterval = Annotated[float, Bounds(0, 1)]
PositiveFraction = Annotated[float, Bounds(sys.float_info.min, 1)]
Quality = Annotated[float, Bounds(0, 100)]
FrameKilobytes = Annotated[float, Bounds(0, 1 << 20)]  # up to a GiB


@dataclass(frozen=True, slots=True)
class Validated:
    """Base class of dataclasses that check their numbers against the bounds of the field types.

    Raises:
        ValueError: An instance is created with a value that is out of bounds.
    """

    def __post_init__(self) -> None:
        type_hints = get_type_hints(type(self), include_extras=True)
        for field in fields(self):
            type_hint, value = type_hints[field.name], getattr(self, field.name)
            for bounds in getattr(type_hint, "__metadata__", ()):
                if not bounds.minimum <= value <= bounds.maximum:
                    message = f"{field.name} takes {describe_values(type_hint)}, not {value!r}"
                    raise ValueError(message)


def describe_values(type_hint: Any) -> str:  # noqa: ANN401
    """Describe the valid values of a setting.

    Args:
        type_hint: Type of the setting, with `Bounds` for bounded numbers.
    """
    value_type, *bounds = (
        get_args(type_hint) if get_origin(type_hint) is Annotated else (type_hint,)
    )
    if get_origin(value_type) is tuple:
        return "integers separated by commas"
    if get_origin(value_type) is Literal:
        return ", ".join(get_args(value_type))
    return " ".join([_TYPE_NAMES[value_type], *map(str, bounds)])


_TYPE_NAMES = {bool: "true, false", int: "an integer", float: "a number"}
