"""Opens files without following links, and locks them while they are open.

A locked file shows other processes that its writer is still running. The system releases the lock
when the writer ends.
"""

import os
import stat
import sys
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from quarc_ref.files.errors import OutputPathError

CAN_LOCK = sys.platform != "win32"  # on Windows, open files cannot be renamed or removed
_BINARY_FLAG = getattr(os, "O_BINARY", 0)
# Without O_NONBLOCK, opening a pipe would block.
_SAFE_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
_FILE_MODE = 0o666  # The umask removes some of these permissions.


def open_regular_file(path: Path, flags: int = os.O_RDWR) -> BinaryIO:
    """Open a regular file for reading and writing; a new file gets default permissions.

    Args:
        path: Path of the file; a symbolic link is rejected.
        flags: Flags of `os.open`; with `os.O_RDONLY`, the file is opened only for reading.

    Raises:
        OutputPathError: The path exists and is not a regular file.
        OSError: The file cannot be opened.
    """
    if path.is_symlink() and not flags & os.O_EXCL:
        message = f"{path} is a symbolic link: use the path of the file itself, or remove the link"
        raise OutputPathError(message)
    descriptor = os.open(path, flags | _SAFE_FLAGS | _BINARY_FLAG, _FILE_MODE)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        message = f"{path} is not a regular file"
        raise OutputPathError(message)
    return os.fdopen(descriptor, "r+b" if flags & os.O_RDWR else "rb")


def lock_file(file: BinaryIO) -> bool | None:
    """Lock a file until it is closed.

    Returns:
        True if the file is locked now, False if another process has locked the file, None if the
        operating system or the file system does not support locks.
    """
    if sys.platform != "win32":
        import fcntl

        with suppress(OSError):
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True
    return None


def is_still_at(file: BinaryIO, path: Path) -> bool:
    """Return whether an open file is still at a path; another process may have moved it."""
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(file.fileno()), path.lstat())
    return False


def create_locked(path: Path) -> BinaryIO:
    """Create a file and lock it.

    Raises:
        FileExistsError: The path exists, or another process has just removed the new file.
        OSError: The file cannot be created.
    """
    file = open_regular_file(path, os.O_RDWR | os.O_CREAT | os.O_EXCL)
    if lock_file(file) is False or not is_still_at(file, path):
        file.close()
        message = f"{path} was removed by another process"
        raise FileExistsError(message)
    return file
