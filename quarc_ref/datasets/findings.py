"""Findings of loading, checks and an encode: what is wrong with a capture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

UNEVEN_LENGTHS = "uneven-lengths"
_MOST_NAMED = 5


@dataclass(frozen=True, slots=True)
class Finding:
    """A reason to expect poor quality.

    Attributes:
        kind: A name that does not change between versions.
        message: A sentence: what is wrong, and what to do.
        cameras: Names of the cameras that it is about; empty if it is about all of them.
    """

    kind: str
    message: str
    cameras: tuple[str, ...] = ()


Report = Callable[[Finding], object]


def ignore(finding: Finding) -> None:
    """Ignore a finding."""


def list_names(names: Sequence[str]) -> str:
    """Return names for a sentence: the first five, and how many more there are."""
    named = ", ".join(names[:_MOST_NAMED])
    more = len(names) - _MOST_NAMED
    return f"{named} and {more} more" if more > 0 else named
