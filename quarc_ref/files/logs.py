"""Opens log files, which other processes can read while lines are written."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, TextIO

from quarc_ref.files.errors import OutputPathError, name_full_disk
from quarc_ref.files.locks import CAN_LOCK, is_still_at, lock_file, open_regular_file


@contextmanager
def open_log(path: Path, *, keep: bool) -> Iterator[TextIO]:
    """Open a file for appending lines, and lock it; it does not change before the first line.

    A last line without an end, which a killed process may have left, is ended first. A file that
    did not exist and is empty at the end, even of an error, is removed.

    Args:
        path: Path of the file; a missing file is created.
        keep: Whether to keep the existing lines of the file.

    Raises:
        OutputPathError: The path is a symbolic link, or not a regular file, or another process is
            writing the file.
        OSError: The file cannot be opened.
    """
    with _open_locked(path) as (file, is_new):
        sink = _LogSink(file, path, keep=keep)
        try:
            try:
                yield sink
            finally:
                sink.flush()
        finally:
            if is_new and os.fstat(file.fileno()).st_size == 0:
                if not CAN_LOCK:
                    file.close()
                path.unlink(missing_ok=True)


class _LogSink(io.TextIOWrapper):
    """A text file that is prepared for new lines when the first line is written.

    Args:
        file: The file, open for reading and appending.
        path: Path of the file.
        keep: Whether to keep the existing lines of the file.
    """

    def __init__(self, file: BinaryIO, path: Path, *, keep: bool) -> None:
        # The end of a line is the same on all systems, like the one that `_prepare` writes.
        super().__init__(file, encoding="utf-8", newline="\n", write_through=False)
        self._file, self._path, self._keep = file, path, keep
        self._is_prepared = False

    def write(self, text: str) -> int:
        """Write text, after the existing lines are removed or their last line is ended."""
        if not self._is_prepared:
            self._is_prepared = True
            _prepare(self._file, keep=self._keep)
        with name_full_disk(self._path):
            return super().write(text)

    def flush(self) -> None:
        """Write buffered text to the file."""
        with name_full_disk(self._path):
            super().flush()


def _prepare(file: BinaryIO, *, keep: bool) -> None:
    if not keep:
        file.truncate(0)
    size = file.seek(0, io.SEEK_END)
    if size:
        file.seek(size - 1)
        if file.read(1) != b"\n":
            file.write(b"\n")


@contextmanager
def _open_locked(path: Path) -> Iterator[tuple[BinaryIO, bool]]:
    """Open and lock a file; also yield whether it is new."""
    while True:
        is_new = not os.path.lexists(path)
        with open_regular_file(path, os.O_RDWR | os.O_CREAT | os.O_APPEND) as file:
            if lock_file(file) is False:
                message = f"{path} is being written by another process"
                raise OutputPathError(message)
            if is_still_at(file, path):
                try:
                    yield file, is_new
                finally:
                    with name_full_disk(path):
                        file.close()
                return
