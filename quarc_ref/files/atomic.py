"""Files that are seen only once they are whole.

A file is written beside its target under a random name that nothing had before, so
that no planted link is followed, and renamed when all is written. It has the
permissions of a new file, not those of the file that it replaces.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from quarc_ref.files.beside import PART, name_beside
from quarc_ref.files.locks import CAN_LOCK, create_locked


@contextmanager
def atomic_file(target: Path, *, durable: bool = False) -> Iterator[BinaryIO]:
    """Open a file that takes a target's place when the block ends without an error.

    Args:
        target: Path of the file. A file or link that is there is replaced;
            the link's target is left alone.
        durable: Whether the file must outlast a power failure once it is there.

    Yields:
        The file, to be written.

    Raises:
        OSError: It cannot be written.
    """
    beside, file = _create_beside(target)
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
    """Let what is written to a file outlast a power failure."""
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Let the names in a folder outlast a power failure, where the system can do that."""
    with suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _create_beside(target: Path) -> tuple[Path, BinaryIO]:
    while True:
        beside = name_beside(target, PART)
        with suppress(FileExistsError):
            return beside, create_locked(beside)
