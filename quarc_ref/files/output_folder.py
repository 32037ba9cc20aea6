"""Output folders, which list each file in a marker before they create the file."""

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from quarc_ref.files.atomic import atomic_file
from quarc_ref.files.errors import OutputPathError, name_full_disk
from quarc_ref.files.folder_contents import contains_files, remove_listed_files
from quarc_ref.files.locks import create_locked, lock_file, open_regular_file
from quarc_ref.files.marker import MARKER_NAME, append_line, begin_marker, continue_marker


class OutputFolder:
    """An output folder, whose marker is open and locked until `close` is called.

    Args:
        path: Path of the folder.
        marker: Marker of the folder, open for reading and writing.
        listed_names: Names that the marker already lists.
        replaces: Whether the first new file removes the existing files that the marker lists.

    Attributes:
        path: Path of the folder.
        has_old_files: Whether the folder still contains the files that the first new file removes.
        moved_to: Path to which the replaced folder was moved, if files that quarc-ref did not
            create are left in it; otherwise None.
    """

    def __init__(
        self,
        path: Path,
        marker: BinaryIO,
        listed_names: Iterable[str] = (),
        *,
        replaces: bool = False,
    ) -> None:
        self.path = path
        self.has_old_files = replaces
        self.moved_to: Path | None = None
        self._marker = marker
        self._listed_names = set(listed_names)

    def register(self, name: str) -> Path:
        """Add the name of a new file to the marker, and return the path at which to create it.

        Raises:
            ValueError: The name is not a plain file name.
            OSError: The marker cannot be written.
        """
        self._append_to_marker(name)
        return self.path / name

    @contextmanager
    def open(self, name: str) -> Iterator[BinaryIO]:
        """Open a new file, which appears in the folder if the block ends without an error."""
        with atomic_file(self.register(name)) as file:
            yield file

    def write(self, name: str, data: bytes) -> Path:
        """Write a file into the folder, and return the file's path."""
        with self.open(name) as file:
            file.write(data)
        return self.path / name

    def link(self, name: str, source: Path) -> Path:
        """Link or copy an existing file into the folder, and return the path of the new file.

        The file is hard-linked if the file system supports it, and copied otherwise.

        Args:
            name: Name of the file in the folder.
            source: Path of the existing file.

        Raises:
            OSError: The file cannot be read or written.
        """
        path = self.register(name)
        try:
            os.link(source.resolve(), path)
        except OSError:
            with source.open("rb") as file, atomic_file(path) as copy:
                shutil.copyfileobj(file, copy)
        return path

    @contextmanager
    def create_subfolder(self, name: str) -> Iterator["OutputFolder"]:
        """Create a subfolder, to which files can be added until the block ends."""
        self._append_to_marker(f"{name}/")
        (self.path / name).mkdir()
        with mark_folder(self.path / name) as subfolder:
            yield subfolder

    def contains_files(self) -> bool:
        """Return whether the folder contains any file other than the marker."""
        return contains_files(self.path)

    def remove_files(self) -> None:
        """Remove all files that the marker lists."""
        remove_listed_files(self.path)

    def close(self) -> None:
        """Close and unlock the marker; afterwards, no files can be added."""
        self._marker.close()

    def __enter__(self) -> "OutputFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _append_to_marker(self, line: str) -> None:
        if self.has_old_files:
            self._remove_old_files()
        if line not in self._listed_names:
            with name_full_disk(self.path):
                append_line(self._marker, line)
            self._listed_names.add(line)

    def _remove_old_files(self) -> None:
        self.remove_files()
        begin_marker(self._marker)
        self._listed_names.clear()
        self.has_old_files = False


def mark_folder(path: Path) -> OutputFolder:
    """Write a marker into an empty folder, and open the folder.

    Raises:
        FileExistsError: A marker exists, or another process has removed the new marker.
        OSError: The marker cannot be written.
    """
    marker = create_locked(path / MARKER_NAME)
    try:
        with name_full_disk(path):
            begin_marker(marker)
    except BaseException:
        with suppress(OSError):
            marker.close()
        (path / MARKER_NAME).unlink()
        raise
    return OutputFolder(path, marker)


def open_marker(path: Path) -> BinaryIO:
    """Open a folder's marker for reading and writing, and lock it.

    Raises:
        OutputPathError: The folder has no marker, or another process is writing the folder.
        OSError: The marker cannot be opened.
    """
    try:
        marker = open_regular_file(path / MARKER_NAME)
    except FileNotFoundError as error:
        message = f"{path} was not created by quarc-ref: it has no {MARKER_NAME}"
        raise OutputPathError(message) from error
    if lock_file(marker) is False:
        marker.close()
        message = f"{path} is being written by another process"
        raise OutputPathError(message)
    return marker


def open_existing_folder(path: Path, *, keep: bool) -> OutputFolder:
    """Open an existing output folder.

    Args:
        path: Path of the folder.
        keep: Whether to keep the files that the marker lists; otherwise, they are removed before
            the first new file is created, and stay if there is none.

    Raises:
        OutputPathError: The folder has no valid marker, or another process is writing the folder.
        OSError: The marker cannot be opened.
    """
    with ExitStack() as stack:
        marker = stack.enter_context(open_marker(path))
        folder = OutputFolder(path, marker, continue_marker(marker, path), replaces=not keep)
        stack.pop_all()
    return folder
