"""Errors that are raised when files and folders are written."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_FULL_DISK_CODES = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class OutputPathError(FileExistsError):
    """An existing file, link or folder must not be replaced, followed or written to.

    Attributes:
        replaceable: Whether quarc-ref created the existing folder, so that `--force` can replace
            it.
    """

    def __init__(self, message: str, *, replaceable: bool = False) -> None:
        super().__init__(message)
        self.replaceable = replaceable


@contextmanager
def name_full_disk(path: Path) -> Iterator[None]:
    """Add the path that the block writes to the error of a full disk, quota or size limit."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL_DISK_CODES and error.filename is None:
            error.filename = str(path)
        raise
