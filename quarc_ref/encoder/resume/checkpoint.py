"""Saves and loads checkpoints of the training of frame 0.

After frame 0 is written, an encode resumes from the stream (`partial_stream`) and needs no
checkpoint.
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
from quarc_ref.files.locks import open_regular_file

_SAVE_INTERVAL_SECONDS = 60.0
_SUFFIX = ".training"


def checkpoint_path(stream_path: Path) -> Path:
    """Return the path of the checkpoint of a stream, in the same folder."""
    return stream_path.with_name(stream_path.name + _SUFFIX)


def remove_checkpoint(path: Path) -> None:
    """Remove a checkpoint and its temporary files, if they exist."""
    path.unlink(missing_ok=True)
    remove_leftovers(path)


class Checkpoint:
    """A file with the complete state of a training run.

    Args:
        path: Path of the file.
        identity: JSON values that identify the run; files of other runs are ignored.
    """

    def __init__(self, path: Path, identity: object) -> None:
        self._path = path
        self._key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()
        self._last_save_time = time.monotonic()

    def load(self, layout: Layout) -> Arrays | None:
        """Load the arrays of the file.

        Args:
            layout: Expected types and shapes.

        Returns:
            The arrays; None if the file is missing, damaged or from a different run.
        """
        try:
            with open_regular_file(self._path, os.O_RDONLY) as file:
                return read_arrays(file, self._key, layout)
        except (OSError, ArrayFileError):
            return None

    def save_if_due(self, get_arrays: Callable[[], Arrays]) -> None:
        """Call `save` if the last save was at least a minute ago.

        Raises:
            OSError: The file cannot be written.
        """
        if time.monotonic() - self._last_save_time >= _SAVE_INTERVAL_SECONDS:
            self.save(get_arrays)

    def save(self, get_arrays: Callable[[], Arrays]) -> None:
        """Replace the content of the file with the arrays that `get_arrays` returns.

        Raises:
            OSError: The file cannot be written.
        """
        with atomic_file(self._path, durable=True) as file:
            write_arrays(file, self._key, get_arrays())
        self._last_save_time = time.monotonic()

    def remove(self) -> None:
        """Remove the file and its temporary files."""
        remove_checkpoint(self._path)
