"""Reads and writes markers: files named `.quarc-ref-made` that list what an output folder contains.

A marker is a text file with a fixed first line, and a name in each further line. Names of
subfolders end with a slash; every subfolder has its own marker. A name is listed before its file is
created. Other users may be able to write markers, so only plain file names are accepted, which
cannot refer to files outside the folder.
"""

import os
import re
from pathlib import Path
from typing import BinaryIO

from quarc_ref.files.errors import OutputPathError
from quarc_ref.files.locks import open_regular_file

MARKER_NAME = ".quarc-ref-made"
_FIRST_LINE = "Made by quarc-ref. --force removes only the files listed here."
_LINE_PATTERN = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]*/?")
_MAX_BYTES = 1 << 26


def begin_marker(marker: BinaryIO) -> None:
    """Write the first line of a marker, and remove all other lines."""
    marker.truncate(marker.seek(0))
    _write_line(marker, _FIRST_LINE)


def append_line(marker: BinaryIO, line: str) -> None:
    """Append the name of a file, or the name of a folder with a trailing slash, to a marker.

    Raises:
        ValueError: The name is not a plain file name.
        OSError: The marker cannot be written.
    """
    if not _LINE_PATTERN.fullmatch(line):
        message = f"{line!r} is not a plain file name"
        raise ValueError(message)
    _write_line(marker, line)


def continue_marker(marker: BinaryIO, folder: Path) -> set[str]:
    """Read the names in a marker, and prepare the marker for appending.

    Raises:
        OutputPathError: The marker is damaged.
    """
    names, end = _read_names(marker, folder)
    marker.truncate(marker.seek(end))
    if not end:
        begin_marker(marker)
    return names


def read_marker(folder: Path) -> set[str]:
    """Read the names in a folder's marker; return an empty set if the folder has no marker.

    Raises:
        OutputPathError: The marker is damaged.
    """
    try:
        with open_regular_file(folder / MARKER_NAME, os.O_RDONLY) as marker:
            return _read_names(marker, folder)[0]
    except FileNotFoundError:
        return set()


def _write_line(marker: BinaryIO, line: str) -> None:
    marker.write(f"{line}\n".encode())
    marker.flush()


def _read_names(marker: BinaryIO, folder: Path) -> tuple[set[str], int]:
    """Return the names in a marker, and the offset at which the last complete line ends.

    Any bytes after that offset are an incomplete line that a killed process left.
    """
    data = marker.read(_MAX_BYTES)
    end = data.rfind(b"\n") + 1
    first_line, *names = data[:end].decode("latin-1").split("\n")[:-1] or [_FIRST_LINE]
    has_valid_start = end > 0 or _FIRST_LINE.encode().startswith(data)
    if (
        not has_valid_start
        or first_line != _FIRST_LINE
        or not all(map(_LINE_PATTERN.fullmatch, names))
    ):
        message = (
            f"{folder / MARKER_NAME} is damaged, or was not written by this version of "
            "quarc-ref: remove the folder, or choose another folder"
        )
        raise OutputPathError(message)
    return set(names), end
