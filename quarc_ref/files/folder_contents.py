"""Distinguishes files that a folder's marker lists, which may be removed, from foreign files."""

import stat
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.files.beside import PART, is_beside
from quarc_ref.files.errors import OutputPathError
from quarc_ref.files.marker import MARKER, read_marker

_DEPTH = 1  # subfolders of subfolders do not occur


def contains_files(folder: Path) -> bool:
    """Return whether a folder exists and contains more than a marker."""
    return folder.is_dir() and any(path.name != MARKER for path in folder.iterdir())


def require_made(folder: Path, depth: int = _DEPTH) -> None:
    """Raise OutputPathError if a folder contains anything that its marker does not list."""
    stock = _take_stock(folder, depth)
    if stock.foreign:
        message = (
            f"{folder} holds {stock.foreign[0].name}, which quarc-ref did not create (it is "
            f"not listed in {MARKER}): remove it, or choose another folder"
        )
        raise OutputPathError(message)
    for path in stock.folders:
        require_made(path, depth - 1)


def remove_made(folder: Path, depth: int = _DEPTH) -> None:
    """Remove the files that a folder's marker lists, and the folder if it has no others.

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
    stock = _take_stock(folder, depth)
    for path in stock.files:
        path.unlink(missing_ok=True)
    for path in stock.folders:
        remove_made(path, depth - 1)


@dataclass(slots=True)
class _Stock:
    """Contents of a folder: files that its marker lists, and foreign ones."""

    files: list[Path] = field(default_factory=list)
    folders: list[Path] = field(default_factory=list)
    foreign: list[Path] = field(default_factory=list)


def _take_stock(folder: Path, depth: int) -> _Stock:
    listed = read_marker(folder)
    stock = _Stock()
    for path in sorted(folder.iterdir()):
        mode = path.lstat().st_mode
        is_listed = path.name in listed or _is_left_of(path.name, listed)
        if path.name == MARKER:
            continue
        if stat.S_ISREG(mode) and is_listed:
            stock.files.append(path)
        elif depth and stat.S_ISDIR(mode) and f"{path.name}/" in listed:
            stock.folders.append(path)
        else:
            stock.foreign.append(path)
    return stock


def _is_left_of(name: str, listed: set[str]) -> bool:
    """Return whether a file was left by a killed process that was writing a listed file."""
    return name.startswith(".") and any(is_beside(name, each, PART) for each in listed)
