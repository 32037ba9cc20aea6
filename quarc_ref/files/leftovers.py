"""Removes leftovers of killed processes beside a target, recognized by name and lock."""

import os
from contextlib import suppress
from pathlib import Path

from quarc_ref.files.beside import OLD, PART, is_beside
from quarc_ref.files.errors import OutputPathError
from quarc_ref.files.folder_contents import remove_made
from quarc_ref.files.locks import lock, open_regular
from quarc_ref.files.marker import MARKER


def remove_leftovers(target: Path) -> None:
    """Remove leftovers of killed processes beside a target.

    Files of living processes or other users are kept, and all files are kept where locking is not
    supported. A folder that was moved aside to be replaced, and was not, is put back.

    Raises:
        OSError: Something cannot be removed.
    """
    target = target.absolute()
    for purpose in (OLD, PART):  # what is to be put back comes first
        for name in _list_names(target.parent):
            if is_beside(name, target.name, purpose):
                _remove(target.with_name(name), target)


def _list_names(folder: Path) -> list[str]:
    with suppress(PermissionError):  # where one may write, and not look
        return sorted(os.listdir(folder))
    return []


def _remove(path: Path, target: Path) -> None:
    if path.is_symlink() or not _is_ours(path):
        return
    is_folder = path.is_dir()
    with suppress(OSError):
        path.rmdir()  # its process was killed before there was a marker in it
    try:
        file = open_regular(path / MARKER if is_folder else path)
    except OSError:
        return
    with file, suppress(OutputPathError):  # a damaged marker
        if not lock(file):
            return
        if not is_folder:
            path.unlink()
        elif path.suffix == f".{OLD}" and not os.path.lexists(target):
            path.rename(target)
        else:
            remove_made(path)


def _is_ours(path: Path) -> bool:
    if not hasattr(os, "geteuid"):
        return True
    with suppress(FileNotFoundError):
        return path.lstat().st_uid == os.geteuid()
    return False
