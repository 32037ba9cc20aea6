"""Files that become visible only when they are complete.

A file is written beside its target under a new random name, so that no planted link is followed,
and renamed when it is complete. It has the permissions of a new file, not those of the file that
it replaces.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from quarc_ref.files.beside import PART, temporary_name
from quarc_ref.files.locks import CAN_LOCK, create_locked


@contextmanager
def atomic_file(target: Path, *, durable: bool = False) -> Iterator[BinaryIO]:
    """Open a file that replaces a target when the block ends without an error.

    Args:
        target: Path of the file. An existing file or link is replaced; the target of the link is
            unchanged.
        durable: Whether the file must survive a power failure once it is visible.

    Yields:
        The file, to be written.

    Raises:
        OSError: It cannot be written.
    """
    beside, file = _create_temporary(target)
    try:
        with file:
            yield file
            if durable:
                sync_file(file)
            file.flush()
            if not CAN_LOCK:
                file.close()
            beside.replace(target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    if durable:
        sync_folder(target.absolute().parent)


def write_file(target: Path, data: bytes, *, durable: bool = False) -> None:
    """Write a file whose bytes are in memory, as `atomic_file` does."""
    with atomic_file(target, durable=durable) as file:
        file.write(data)


def sync_file(file: BinaryIO) -> None:
    """Flush a file to disk, so that it survives a power failure."""
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Flush the names of a folder to disk, where the system supports that."""
    with suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _create_temporary(target: Path) -> tuple[Path, BinaryIO]:
    while True:
        beside = temporary_name(target, PART)
        with suppress(FileExistsError):
            return beside, create_locked(beside)
