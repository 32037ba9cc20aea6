"""Opens log files, which other processes can read while lines are written."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from quarc_ref.files.locks import open_regular_file


@contextmanager
def open_log(path: Path, *, keep: bool) -> Iterator[TextIO]:
    """Open a file for appending lines; if it is empty at the end, even of an error, it is removed.

    A last line without an end, which a killed process may have left, is ended first.

    Args:
        path: Path of the file; a missing file is created.
        keep: Whether to keep the existing lines of the file.

    Raises:
        OutputPathError: The path is a symbolic link, or not a regular file.
        OSError: The file cannot be opened.
    """
    with open_regular_file(path, os.O_RDWR | os.O_CREAT) as file:
        if not keep:
            file.truncate(0)
        size = file.seek(0, io.SEEK_END)
        if size:
            file.seek(size - 1)
            if file.read(1) != b"\n":
                file.write(b"\n")
        try:
            with io.TextIOWrapper(file, encoding="utf-8", write_through=False) as sink:
                yield sink
        finally:
            with suppress(FileNotFoundError):
                if path.stat().st_size == 0:
                    path.unlink()
