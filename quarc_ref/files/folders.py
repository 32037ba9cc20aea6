"""Creates output folders, either hidden until they are complete, or at their final paths."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from quarc_ref.files.errors import OutputPathError, name_target
from quarc_ref.files.folder_contents import remove_output_folder, require_no_foreign_files
from quarc_ref.files.leftovers import remove_leftovers
from quarc_ref.files.locks import CAN_LOCK
from quarc_ref.files.marker import MARKER_NAME
from quarc_ref.files.output_folder import (
    OutputFolder,
    mark_folder,
    open_existing_folder,
    open_marker,
)
from quarc_ref.files.temporary_paths import PART_SUFFIX, make_old_path, make_temporary_path


@contextmanager
def written_folder(target: Path, *, replace: bool = False) -> Iterator[OutputFolder]:
    """Yield a temporary folder, which replaces the target if the block ends without an error.

    Args:
        target: Path of the folder; an empty folder may exist.
        replace: Whether to replace a folder that quarc-ref created.

    Yields:
        The folder to fill.

    Raises:
        OutputPathError: The path exists and cannot be replaced, or another process is writing the
            folder.
        OSError: The folder cannot be written.
    """
    _require_movable(target)
    _require_available(target, replace=replace)
    folder = _make_temporary_folder(target)
    try:
        with name_target(folder.path, target), folder:
            yield folder
            if not CAN_LOCK:
                folder.close()
            _move_to_target(folder, target, replace=replace)
    except BaseException:
        if folder.path.is_dir():
            remove_output_folder(folder.path)
        raise


@contextmanager
def growing_folder(
    target: Path, *, replace: bool = False, keep: bool = False
) -> Iterator[OutputFolder]:
    """Yield a folder at its final path, whose files remain after an error.

    If the folder is empty at the end, it is removed.

    Args:
        target: Path of the folder; an empty folder may exist.
        replace: Whether to reuse a folder that quarc-ref created.
        keep: Whether to keep the existing files of a reused folder; otherwise, the first new file
            removes them.

    Yields:
        The folder to fill.

    Raises:
        OutputPathError: The path exists and cannot be reused, or another process is writing the
            folder.
        OSError: The folder cannot be written.
    """
    _require_available(target, replace=replace)
    with _open_in_place(target, keep=keep) as folder:
        try:
            yield folder
        finally:
            if not folder.contains_files():
                if not CAN_LOCK:
                    folder.close()
                remove_output_folder(target)


def _open_in_place(target: Path, *, keep: bool) -> OutputFolder:
    target.mkdir(exist_ok=True)
    try:
        if not (target / MARKER_NAME).exists():
            return mark_folder(target)
        return open_existing_folder(target, keep=keep)
    except BaseException:
        with suppress(OSError):  # the folder is not empty
            target.rmdir()
        raise


def _require_movable(target: Path) -> None:
    """Raise OutputPathError if a path is a folder that cannot be replaced by a renamed folder."""
    if os.path.ismount(target):
        kind = "a mount point"
    elif not target.name:
        kind = "the current folder"
    else:
        return
    message = f"{target} is {kind}, which cannot be replaced: choose a new folder in it"
    raise OutputPathError(message)


def _require_available(target: Path, *, replace: bool) -> None:
    """Raise OutputPathError if a path exists and is not a folder that can be replaced."""
    remove_leftovers(target)
    if not os.path.lexists(target):
        return
    if target.is_symlink() or not target.is_dir():
        message = f"{target} is a symbolic link, or is not a folder"
        raise OutputPathError(message)
    require_no_foreign_files(target)
    if any(target.iterdir()):
        if not replace:
            message = f"{target} exists"
            raise OutputPathError(message, replaceable=True)
        open_marker(target).close()


def _make_temporary_folder(target: Path) -> OutputFolder:
    while True:
        temporary_path = make_temporary_path(target, PART_SUFFIX)
        try:
            with name_target(temporary_path, target):
                temporary_path.mkdir()
        except FileExistsError:
            continue
        try:
            with name_target(temporary_path, target):
                return mark_folder(temporary_path)
        except FileNotFoundError:  # another process has removed the folder because it was empty
            continue
        except BaseException:
            with suppress(OSError):
                temporary_path.rmdir()
            raise


def _move_to_target(folder: OutputFolder, target: Path, *, replace: bool) -> None:
    with suppress(OSError):  # the target does not exist, or is not empty
        target.rmdir()
    if not os.path.lexists(target):
        folder.path.rename(target)
    elif replace:
        _replace_folder(folder, target)
    else:
        message = f"{target} was created by another process at the same time: choose another path"
        raise OutputPathError(message)


def _replace_folder(folder: OutputFolder, target: Path) -> None:
    """Replace an existing folder, and delete the files that its marker lists.

    The old folder is renamed before the new folder is moved to its path. If the process is killed
    between these two steps, the next process restores the old folder (`remove_leftovers`).
    """
    old_path = make_old_path(folder.path)
    with open_marker(target) as marker:
        if not CAN_LOCK:
            marker.close()
        try:
            target.rename(old_path)
            folder.path.rename(target)
        except BaseException:
            if not os.path.lexists(target):
                old_path.rename(target)
            raise
        with suppress(OSError):
            remove_output_folder(old_path)
    if old_path.exists():
        folder.moved_to = old_path
