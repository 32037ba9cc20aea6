"""Writes files that several processes may write at the same time."""

from pathlib import Path

from quarc_ref.files import write_file


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file and its parent folders; the file appears when it is complete.

    Several processes may write the same file; the last one remains.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, data)
