"""Opens log files, which other processes can read while lines are written."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from quarc_ref.files.locks import open_regular_file


@contextmanager
def open_log(path: Path, *, keep: bool) -> Iterator[TextIO]:
    """Open a file for appending lines; if the file is empty at the end, it is removed.

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
        with io.TextIOWrapper(file, encoding="utf-8", write_through=False) as sink:
            yield sink
            sink.flush()
            is_empty = file.tell() == 0
    if is_empty:
        path.unlink(missing_ok=True)
