"""Findings: possible problems of a capture, reported by loading, checks and encoding."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

UNEVEN_LENGTHS = "uneven-lengths"
_MAX_NAMED = 5


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem that does not prevent encoding, but makes poor quality likely.

    Attributes:
        kind: Stable name of the kind of finding.
        message: A sentence that describes the problem and its remedy.
        cameras: Names of the affected cameras; empty if all are affected.
    """

    kind: str
    message: str
    cameras: tuple[str, ...] = ()


Report = Callable[[Finding], object]


def ignore(finding: Finding) -> None:
    """Ignore a finding."""


def list_names(names: Sequence[str]) -> str:
    """Return the first five names and the number of further names, as part of a sentence."""
    named = ", ".join(names[:_MAX_NAMED])
    more = len(names) - _MAX_NAMED
    return f"{named} and {more} more" if more > 0 else named
