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


@contextmanager
def name_target(temporary_path: Path, target: Path) -> Iterator[None]:
    """Replace a hidden temporary path in the error of a block by the target that it becomes."""
    try:
        yield
    except OSError as error:
        if isinstance(error.filename, str | Path):
            path = Path(error.filename)
            if path.is_relative_to(temporary_path):
                error.filename = str(target / path.relative_to(temporary_path))
        raise
