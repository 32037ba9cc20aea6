"""Lists and removes the files in a folder's marker, and detects all other files."""

import stat
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.files.beside import PART, is_temporary_name
from quarc_ref.files.errors import OutputPathError
from quarc_ref.files.marker import MARKER, read_marker

_DEPTH = 1  # Output folders have subfolders, but no subfolders of subfolders.


def contains_files(folder: Path) -> bool:
    """Return whether a folder exists and contains any file other than a marker."""
    return folder.is_dir() and any(path.name != MARKER for path in folder.iterdir())


def require_no_foreign_files(folder: Path, depth: int = _DEPTH) -> None:
    """Raise OutputPathError if a folder contains anything that its marker does not list."""
    stock = _list_contents(folder, depth)
    if stock.foreign:
        message = (
            f"{folder} contains {stock.foreign[0].name}, which quarc-ref did not create (it is "
            f"not listed in {MARKER}): remove this file, or choose another folder"
        )
        raise OutputPathError(message)
    for path in stock.folders:
        require_no_foreign_files(path, depth - 1)


def remove_listed_with_subfolders(folder: Path, depth: int = _DEPTH) -> None:
    """Remove the files that a folder's marker lists, and the folder if it is empty afterwards.

    Raises:
        OutputPathError: The marker is damaged.
        OSError: A file cannot be removed.
    """
    remove_listed(folder, depth)
    (folder / MARKER).unlink(missing_ok=True)
    with suppress(OSError):  # it contains other files
        folder.rmdir()


def remove_listed(folder: Path, depth: int = _DEPTH) -> None:
    """Remove the files that a folder's marker lists.

    Raises:
        OutputPathError: The marker is damaged.
        OSError: A file cannot be removed.
    """
    stock = _list_contents(folder, depth)
    for path in stock.files:
        path.unlink(missing_ok=True)
    for path in stock.folders:
        remove_listed_with_subfolders(path, depth - 1)


@dataclass(slots=True)
class _Contents:
    """Contents of a folder: files and subfolders that its marker lists, and all other paths."""

    files: list[Path] = field(default_factory=list)
    folders: list[Path] = field(default_factory=list)
    foreign: list[Path] = field(default_factory=list)


def _list_contents(folder: Path, depth: int) -> _Contents:
    listed = read_marker(folder)
    stock = _Contents()
    for path in sorted(folder.iterdir()):
        mode = path.lstat().st_mode
        is_listed = path.name in listed or _is_leftover_of(path.name, listed)
        if path.name == MARKER:
            continue
        if stat.S_ISREG(mode) and is_listed:
            stock.files.append(path)
        elif depth and stat.S_ISDIR(mode) and f"{path.name}/" in listed:
            stock.folders.append(path)
        else:
            stock.foreign.append(path)
    return stock


def _is_leftover_of(name: str, listed: set[str]) -> bool:
    """Return whether a file is the temporary file of a listed file, from a killed process."""
    return name.startswith(".") and any(is_temporary_name(name, each, PART) for each in listed)
