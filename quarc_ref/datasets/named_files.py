"""Resolves files named by a description of a capture, which must be in the same folder.

Opening a capture from someone else must not read other files of the machine through `..`, an
absolute path or a link.
"""

import os
from pathlib import Path

from quarc_ref.datasets.errors import MissingFileError, OutsideFileError


class NamedFiles:
    """Resolver of the file names in a description.

    Args:
        description: Description file, such as `transforms.json`; names in it are relative to its
            folder.
    """

    def __init__(self, description: Path) -> None:
        self._description = description
        self._folder = description.parent
        self._real_folder = self._folder.resolve()

    def find(self, name: str) -> Path:
        """Return the path of a regular file.

        Raises:
            MissingFileError: The file does not exist.
            OutsideFileError: The file is outside the folder.
        """
        path = self._folder / name
        try:
            is_inside = path.resolve().is_relative_to(self._real_folder)
        # `resolve` raises these for cyclic links and null characters
        except (OSError, RuntimeError, ValueError) as error:
            message = f"{self._description} names {name!r}, which cannot be a file: {error}"
            raise MissingFileError(message) from error
        if not is_inside:
            message = (
                f"{self._description} names {name}, which is outside its folder: move the "
                "file into the folder, and use a relative path"
            )
            raise OutsideFileError(message)
        if not os.path.isfile(path):  # unlike `Path.is_file`, never raises
            message = f"{path}, which {self._description} names, is missing or not a regular file"
            raise MissingFileError(message)
        return path
