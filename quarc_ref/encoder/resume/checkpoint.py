"""Saves and loads checkpoints of the training of frame 0.

After frame 0 is written, an encode resumes from the stream (`partial_stream`) and needs no
checkpoint.
"""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

from quarc_ref.encoder.resume.array_file import (
    ArrayFileError,
    Arrays,
    Layout,
    OtherKeyError,
    read_arrays,
    write_arrays,
)
from quarc_ref.encoder.resume.differences import compare_metadata, make_resume_error
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
        identity: Metadata that identifies the run.
    """

    def __init__(self, path: Path, identity: dict[str, str]) -> None:
        self._path, self._identity = path, identity
        self._key = json.dumps(identity)
        self._last_save_time = time.monotonic()

    def load(self, layout: Layout) -> Arrays | None:
        """Load the arrays of the file.

        Args:
            layout: Expected types and shapes.

        Returns:
            The arrays; None if the file is missing or damaged, or is no checkpoint.

        Raises:
            ResumeError: The file is from a different run.
        """
        try:
            with open_regular_file(self._path, os.O_RDONLY) as file:
                return read_arrays(file, self._key, layout)
        except OtherKeyError as error:
            identity = _parse_identity(error.key)
            if not identity:
                return None
            what = f"the training state in {self._path} was saved"
            differences = compare_metadata(identity, self._identity)
            raise make_resume_error(what, differences) from error
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


def _parse_identity(key: str) -> dict[str, str]:
    """Return the metadata in the key of a file; empty if it contains none."""
    try:
        identity = json.loads(key)
    except (ValueError, RecursionError):
        return {}
    if not isinstance(identity, dict):
        return {}
    return {name: value for name, value in identity.items() if isinstance(value, str)}
