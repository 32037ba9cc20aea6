"""Removes temporary files that killed processes left next to a target."""

import os
from contextlib import suppress
from pathlib import Path

from quarc_ref.files.errors import OutputPathError
from quarc_ref.files.folder_contents import remove_output_folder
from quarc_ref.files.locks import lock_file, open_regular_file
from quarc_ref.files.marker import MARKER_NAME
from quarc_ref.files.temporary_paths import OLD_SUFFIX, PART_SUFFIX, is_temporary_name


def remove_leftovers(target: Path) -> None:
    """Remove temporary files that killed processes left next to a target.

    Files that belong to running processes or other users are kept. If the system does not support
    locks, all files are kept. If a process was killed while it replaced the target folder, the old
    folder is restored.

    Raises:
        OSError: A file cannot be removed.
    """
    target = target.absolute()
    for suffix in (OLD_SUFFIX, PART_SUFFIX):  # folders to restore come first
        for name in _list_names(target.parent):
            if is_temporary_name(name, target.name, suffix):
                _remove_leftover(target.with_name(name), target)


def _list_names(folder: Path) -> list[str]:
    with suppress(PermissionError):  # the folder may be writable but not readable
        return sorted(os.listdir(folder))
    return []


def _remove_leftover(path: Path, target: Path) -> None:
    if path.is_symlink() or not _is_owned_by_user(path):
        return
    is_folder = path.is_dir()
    with suppress(OSError):
        path.rmdir()  # an empty folder: its process was killed before it wrote the marker
    try:
        file = open_regular_file(path / MARKER_NAME if is_folder else path)
    except OSError:
        return
    with file, suppress(OutputPathError):  # a damaged marker
        if not lock_file(file):
            return
        if not is_folder:
            path.unlink()
        elif path.suffix == f".{OLD_SUFFIX}" and not os.path.lexists(target):
            path.rename(target)
        else:
            remove_output_folder(path)


def _is_owned_by_user(path: Path) -> bool:
    if not hasattr(os, "geteuid"):
        return True
    with suppress(FileNotFoundError):
        return path.lstat().st_uid == os.geteuid()
    return False
