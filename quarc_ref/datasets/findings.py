"""Findings: possible problems of a capture, which loading, checks and encoding report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

UNEVEN_LENGTHS = "uneven-lengths"
STATED_FRAME_RATE = "stated-frame-rate"
FRAME_NUMBERS = "frame-numbers"
_MAX_NAMES = 5


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem that does not prevent encoding, but makes poor quality likely.

    Attributes:
        kind: Name of the kind of finding, which is stable between versions.
        message: A sentence that describes the problem and its remedy.
        cameras: Names of the affected cameras; empty if all are affected.
    """

    kind: str
    message: str
    cameras: tuple[str, ...] = ()


FindingCallback = Callable[[Finding], object]


def ignore_finding(finding: Finding) -> None:
    """Ignore a finding."""


def format_names(names: Sequence[str]) -> str:
    """Return the first five names and the number of further names, as part of a sentence."""
    first_names = ", ".join(names[:_MAX_NAMES])
    omitted_count = len(names) - _MAX_NAMES
    return f"{first_names} and {omitted_count} more" if omitted_count > 0 else first_names


def report_missing_poses(names: Sequence[str], poses: Path) -> tuple[Finding, ...]:
    """Return a finding about recordings without poses; nothing if there are none.

    Args:
        names: Names of the cameras that have recordings, but no poses.
        poses: File or folder of the poses.
    """
    if not names:
        return ()
    message = (
        f"recordings of {format_names(names)} have no poses in {poses}, so they are not used: "
        "calibrate again with more matches, or remove these files"
    )
    return (Finding("camera-without-pose", message),)
