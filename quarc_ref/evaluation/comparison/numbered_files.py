"""Orders files with frame numbers in their names."""

import re
from collections.abc import Iterable
from pathlib import Path

from quarc_ref.evaluation.comparison.entries import EntryError

_NUMBER = re.compile(r"(\d+)\D*\Z")
_MAX_DIGITS = 18


def number_files(paths: Iterable[Path], place: Path) -> dict[int, Path]:
    """Return files by the last number in their names, in ascending order.

    Args:
        paths: Paths of the files; a single file needs no number.
        place: Folder of the files, for messages.

    Raises:
        EntryError: There are no files, a file has no number, or two have the same number.
    """
    listed = sorted(paths)
    if not listed:
        message = f"{place} has no frames"
        raise EntryError(message)
    if len(listed) == 1 and find_number(listed[0].stem) is None:
        return {0: listed[0]}
    numbered: dict[int, Path] = {}
    for path in listed:
        number = find_number(path.stem)
        if number is None:
            message = f"the name of {path} has no frame number"
            raise EntryError(message)
        if number in numbered:
            message = f"{numbered[number]} and {path} have the same frame number"
            raise EntryError(message)
        numbered[number] = path
    return dict(sorted(numbered.items()))


def find_number(stem: str) -> int | None:
    """Return the last number in a name; None if there is none."""
    found = _NUMBER.search(stem)
    return int(found[1]) if found and len(found[1]) <= _MAX_DIGITS else None
