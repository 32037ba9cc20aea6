"""Writes files that become visible only when they are complete.

A file is written next to its target under a new random name, so that no existing link is followed,
and is renamed to its target when it is complete. The file gets the permissions of a new file, even
if it replaces a file with different permissions.
"""

import io
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from quarc_ref.files.errors import name_full_disk, name_target
from quarc_ref.files.locks import CAN_LOCK, create_locked
from quarc_ref.files.temporary_paths import PART_SUFFIX, make_temporary_path


@contextmanager
def atomic_file(target: Path, *, durable: bool = False) -> Iterator[BinaryIO]:
    """Open a file that replaces a target when the block ends without an error.

    Args:
        target: Path of the file. An existing file or link is replaced; the file that a link points
            to does not change.
        durable: Whether the file must survive a power failure once it is visible.

    Yields:
        The open file.

    Raises:
        OSError: The file cannot be written; the error of a full or read-only disk names the target.
    """
    temporary_path, file = _create_temporary_file(target)
    try:
        with name_full_disk(target), name_target(temporary_path, target), file:
            yield file
            if durable:
                sync_file(file)
            file.flush()
            if not CAN_LOCK:
                file.close()
            temporary_path.replace(target)
    except BaseException:
        temporary_path.unlink(missing_ok=True)
        raise
    if durable:
        sync_folder(target.absolute().parent)


def write_file(target: Path, data: bytes) -> None:
    """Write bytes to a file that becomes visible only when it is complete.

    Args:
        target: Path of the file; an existing file or link is replaced.
        data: Contents of the file.
    """
    with atomic_file(target) as file:
        file.write(data)


def sync_file(file: BinaryIO) -> None:
    """Flush a file to disk, so that it survives a power failure.

    Sinks that are not on disk, such as pipes and `BytesIO`, are only flushed.
    """
    file.flush()
    with suppress(io.UnsupportedOperation):
        if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Flush a folder's directory entries to disk, if the system supports it."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _create_temporary_file(target: Path) -> tuple[Path, BinaryIO]:
    while True:
        temporary_path = make_temporary_path(target, PART_SUFFIX)
        with suppress(FileExistsError), name_target(temporary_path, target):
            return temporary_path, create_locked(temporary_path)
