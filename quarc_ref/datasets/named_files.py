"""Resolves file names in the description of a capture, and rejects files outside its folder.

A capture from someone else must not make the loader read other files of the machine through `..`,
an absolute path or a link.
"""

import os
from pathlib import Path

from quarc_ref.datasets.errors import MissingFileError, OutsideFileError


class NamedFiles:
    """Resolver of the file names in a description.

    Args:
        description: Description file, such as `transforms.json`. File names in the description are
            relative to its folder.
    """

    def __init__(self, description: Path) -> None:
        self._description = description
        self._folder = description.parent
        self._real_folder = self._folder.resolve()

    def find(self, name: str) -> Path:
        """Return the path of the regular file that the description names.

        Raises:
            MissingFileError: The file does not exist, or is not a regular file.
            OutsideFileError: The file is outside the description's folder.
        """
        path = self._folder / name
        try:
            is_inside = path.resolve().is_relative_to(self._real_folder)
        # `resolve` raises these exceptions for cyclic links and null characters.
        except (OSError, RuntimeError, ValueError) as error:
            message = f"{self._description} names {name!r}, which is not a valid path: {error}"
            raise MissingFileError(message) from error
        if not is_inside:
            message = (
                f"{self._description} names {name}, which is outside its folder: move the "
                "file into the folder, and use a relative path"
            )
            raise OutsideFileError(message)
        if not os.path.isfile(path):  # Unlike `Path.is_file`, `isfile` never raises an exception.
            message = f"{self._description} names {path}, which is missing or not a regular file"
            raise MissingFileError(message)
        return path
