"""Lists and removes the files that a folder's marker lists, and detects all other files."""

import stat
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.files.errors import OutputPathError
from quarc_ref.files.marker import MARKER_NAME, read_marker
from quarc_ref.files.temporary_paths import PART_SUFFIX, is_temporary_name

_MAX_DEPTH = 1  # Output folders have subfolders, but no subfolders of subfolders.


def contains_files(folder: Path) -> bool:
    """Return whether a folder exists and contains any file other than a marker."""
    return folder.is_dir() and any(path.name != MARKER_NAME for path in folder.iterdir())


def require_no_foreign_files(folder: Path, depth: int = _MAX_DEPTH) -> None:
    """Raise OutputPathError if a folder contains anything that its marker does not list."""
    contents = _list_contents(folder, depth)
    if contents.foreign_paths:
        message = (
            f"{folder} contains {contents.foreign_paths[0].name}, which quarc-ref did not create "
            f"(it is not listed in {MARKER_NAME}): remove it, or choose another folder"
        )
        raise OutputPathError(message)
    for path in contents.folders:
        require_no_foreign_files(path, depth - 1)


def remove_output_folder(folder: Path, depth: int = _MAX_DEPTH) -> None:
    """Remove the files that a folder's marker lists; also remove the folder if it is then empty.

    Raises:
        OutputPathError: The marker is damaged.
        OSError: A file cannot be removed.
    """
    remove_listed_files(folder, depth)
    (folder / MARKER_NAME).unlink(missing_ok=True)
    with suppress(OSError):  # the folder contains other files
        folder.rmdir()


def remove_listed_files(folder: Path, depth: int = _MAX_DEPTH) -> None:
    """Remove the files that a folder's marker lists.

    Raises:
        OutputPathError: The marker is damaged.
        OSError: A file cannot be removed.
    """
    contents = _list_contents(folder, depth)
    for path in contents.files:
        path.unlink(missing_ok=True)
    for path in contents.folders:
        remove_output_folder(path, depth - 1)


@dataclass(slots=True)
class _Contents:
    """Contents of a folder: files and subfolders that its marker lists, and all other paths."""

    files: list[Path] = field(default_factory=list)
    folders: list[Path] = field(default_factory=list)
    foreign_paths: list[Path] = field(default_factory=list)


def _list_contents(folder: Path, depth: int) -> _Contents:
    listed_names = read_marker(folder)
    contents = _Contents()
    for path in sorted(folder.iterdir()):
        mode = path.lstat().st_mode
        is_listed = path.name in listed_names or _is_leftover(path.name, listed_names)
        if path.name == MARKER_NAME:
            continue
        if stat.S_ISREG(mode) and is_listed:
            contents.files.append(path)
        elif depth and stat.S_ISDIR(mode) and f"{path.name}/" in listed_names:
            contents.folders.append(path)
        else:
            contents.foreign_paths.append(path)
    return contents


def _is_leftover(name: str, listed_names: set[str]) -> bool:
    """Return whether this is a temporary file of a listed file, left by a killed process."""
    return name.startswith(".") and any(
        is_temporary_name(name, listed_name, PART_SUFFIX) for listed_name in listed_names
    )
