"""Orders files by the frame numbers in their names."""

import re
from collections.abc import Iterable
from pathlib import Path

from quarc_ref.evaluation.comparison.entries import EntryError

_LAST_NUMBER_PATTERN = re.compile(r"(\d+)\D*\Z")
_MAX_DIGITS = 18


def sort_by_frame_number(paths: Iterable[Path], folder: Path) -> dict[int, Path]:
    """Return files, keyed and sorted by the last number in their names.

    Args:
        paths: Paths of the files; a single file without a number is frame 0.
        folder: Folder of the files, for error messages.

    Raises:
        EntryError: There are no files, a file has no number, or two have the same number.
    """
    sorted_paths = sorted(paths)
    if not sorted_paths:
        message = f"{folder} has no files that contain frames"
        raise EntryError(message)
    if len(sorted_paths) == 1 and find_frame_number(sorted_paths[0].stem) is None:
        return {0: sorted_paths[0]}
    path_by_number: dict[int, Path] = {}
    for path in sorted_paths:
        number = find_frame_number(path.stem)
        if number is None:
            message = f"the name of {path} has no frame number"
            raise EntryError(message)
        if number in path_by_number:
            message = f"{path_by_number[number]} and {path} have the same frame number"
            raise EntryError(message)
        path_by_number[number] = path
    return dict(sorted(path_by_number.items()))


def find_frame_number(stem: str) -> int | None:
    """Return the last number in a file name; None if the name contains no number."""
    match = _LAST_NUMBER_PATTERN.search(stem)
    return int(match[1]) if match and len(match[1]) <= _MAX_DIGITS else None
