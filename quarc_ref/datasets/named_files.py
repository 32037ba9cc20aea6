"""Resolves file names in a description file of a capture, and rejects files outside its folder.

A capture from an untrusted source must not make the loader read files elsewhere on the machine
through `..`, an absolute path or a link.
"""

import os
from pathlib import Path

from quarc_ref.datasets.errors import MissingFileError, OutsideFileError


class NamedFileResolver:
    """Finds the files that a description file names.

    Args:
        description: Path of the description file, such as `transforms.json`. The file names in it
            are relative to its folder.
    """

    def __init__(self, description: Path) -> None:
        self._description = description
        self._folder = description.parent
        self._real_folder = self._folder.resolve()

    def find(self, name: str) -> Path:
        """Return the path of a regular file that the description file names.

        Raises:
            MissingFileError: The file does not exist, or is not a regular file.
            OutsideFileError: The file is outside the description file's folder.
        """
        path = self._folder / name
        try:
            is_inside = path.resolve().is_relative_to(self._real_folder)
        # `resolve` raises these exceptions for cyclic links and null characters.
        except (OSError, RuntimeError, ValueError) as error:
            message = f"{self._description} names {name!r}, which is not a valid path: {error}"
            raise MissingFileError(message) from error
        if not is_inside:
            remedy = ": move the file into the folder, and use a relative path"
            if Path(os.path.abspath(path)).is_relative_to(os.path.abspath(self._folder)):
                remedy = ", behind a link: replace the link with the file itself, or a hard link"
            message = f"{self._description} names {name}, which is outside its folder{remedy}"
            raise OutsideFileError(message)
        if not os.path.isfile(path):  # Unlike `Path.is_file`, `isfile` never raises an exception.
            message = f"{self._description} names {path}, which is missing or not a regular file"
            raise MissingFileError(message)
        return path
