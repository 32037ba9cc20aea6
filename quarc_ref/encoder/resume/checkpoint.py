"""The training of a canonical frame on disk, so that one that breaks off is gone on with.

Later frames need none of this: they go on from the stream itself (`resume`).
"""

import hashlib
import json
import os
import time
from collections.abc import Callable
from pathlib import Path

from quarc_ref.encoder.resume.array_file import (
    ArrayFileError,
    Arrays,
    Layout,
    read_arrays,
    write_arrays,
)
from quarc_ref.files import atomic_file, remove_leftovers
from quarc_ref.files.locks import open_regular

_SECONDS_APART = 60.0
_SUFFIX = ".training"


def checkpoint_path(stream: Path) -> Path:
    """Return the file beside a stream that holds the training of its frame 0."""
    return stream.with_name(stream.name + _SUFFIX)


def remove_checkpoint(path: Path) -> None:
    """Remove the file of a checkpoint, and what killed processes have left of it."""
    path.unlink(missing_ok=True)
    remove_leftovers(path)


class Checkpoint:
    """A file with all that the next step of a training needs, renewed every minute at least.

    Args:
        path: Of the file.
        said: What tells this training from all others, in JSON's types.
    """

    def __init__(self, path: Path, said: object) -> None:
        self._path = path
        self._key = hashlib.sha256(json.dumps(said).encode()).hexdigest()
        self._saved = time.monotonic()

    def load(self, layout: Layout) -> Arrays | None:
        """Return what was saved; None if that is nothing, or nothing whole, of this training.

        Args:
            layout: What the arrays of this training can be.
        """
        try:
            with open_regular(self._path, os.O_RDONLY) as file:
                return read_arrays(file, self._key, layout)
        except (OSError, ArrayFileError):
            return None

    def save_if_due(self, describe: Callable[[], Arrays]) -> None:
        """Do as `save`, if the file is a minute old.

        Raises:
            OSError: The file cannot be written.
        """
        if time.monotonic() - self._saved >= _SECONDS_APART:
            self.save(describe)

    def save(self, describe: Callable[[], Arrays]) -> None:
        """Put what `describe` returns in the file's place.

        Raises:
            OSError: The file cannot be written.
        """
        with atomic_file(self._path, durable=True) as file:
            write_arrays(file, self._key, describe())
        self._saved = time.monotonic()

    def remove(self) -> None:
        """Remove the file, and what killed processes have left of it."""
        remove_checkpoint(self._path)
