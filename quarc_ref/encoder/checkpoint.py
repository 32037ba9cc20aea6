"""The training of a canonical frame on disk, so that one that breaks off is gone on with.

Later frames need none of this: they go on from the stream itself (`resume`).
"""

import hashlib
import json
import os
import time
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]

_SECONDS_APART = 60.0
_SUFFIX = ".training"
_PART = ".part"
_KEY = "key"


def name_checkpoint(stream: Path) -> Path:
    """Return the file beside a stream that holds the training of its frame 0."""
    return stream.with_name(stream.name + _SUFFIX)


class Checkpoint:
    """A file with all that the next step of a training hangs on, renewed every minute at least.

    Args:
        path: Of the file.
        said: What tells this training from all others, in JSON's types.
    """

    def __init__(self, path: Path, said: object) -> None:
        self._path = path
        self._key = hashlib.sha256(json.dumps(said).encode()).hexdigest()
        self._saved = time.monotonic()

    def load(self) -> Arrays | None:
        """Return what was saved; None if there is nothing, or nothing whole, of this training."""
        try:
            with self._path.open("rb") as file, np.load(file, allow_pickle=False) as saved:
                arrays: Arrays = {name: saved[name] for name in saved.files}
        except (OSError, EOFError, ValueError, zipfile.BadZipFile, zlib.error):
            return None
        return arrays if str(arrays.pop(_KEY, "")) == self._key else None

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
        part = self._path.with_name(self._path.name + _PART)
        contents: dict[str, Any] = {**describe(), _KEY: np.array(self._key)}
        with part.open("wb") as file:
            np.savez(file, **contents)
        os.replace(part, self._path)
        self._saved = time.monotonic()

    def remove(self) -> None:
        """Remove the file, and what a writing that broke off has left."""
        for path in (self._path, self._path.with_name(self._path.name + _PART)):
            path.unlink(missing_ok=True)
