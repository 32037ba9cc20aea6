"""Checkpoints of the training of a canonical frame.

Later frames resume from the stream itself (`partial_stream`) without checkpoints.
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
    """Return the path of the checkpoint next to a stream."""
    return stream.with_name(stream.name + _SUFFIX)


def remove_checkpoint(path: Path) -> None:
    """Remove a checkpoint and its temporary files."""
    path.unlink(missing_ok=True)
    remove_leftovers(path)


class Checkpoint:
    """A file with the complete training state, written every minute.

    Args:
        path: Path of the file.
        said: JSON values that identify this training.
    """

    def __init__(self, path: Path, said: object) -> None:
        self._path = path
        self._key = hashlib.sha256(json.dumps(said).encode()).hexdigest()
        self._saved = time.monotonic()

    def load(self, layout: Layout) -> Arrays | None:
        """Load the arrays; None if the file is missing, damaged or from another training.

        Args:
            layout: Expected arrays of this training.
        """
        try:
            with open_regular(self._path, os.O_RDONLY) as file:
                return read_arrays(file, self._key, layout)
        except (OSError, ArrayFileError):
            return None

    def save_if_due(self, describe: Callable[[], Arrays]) -> None:
        """Save if the last save was at least a minute ago.

        Raises:
            OSError: The file cannot be written.
        """
        if time.monotonic() - self._saved >= _SECONDS_APART:
            self.save(describe)

    def save(self, describe: Callable[[], Arrays]) -> None:
        """Replace the file with the arrays that `describe` returns.

        Raises:
            OSError: The file cannot be written.
        """
        with atomic_file(self._path, durable=True) as file:
            write_arrays(file, self._key, describe())
        self._saved = time.monotonic()

    def remove(self) -> None:
        """Remove the file and its temporary files."""
        remove_checkpoint(self._path)
