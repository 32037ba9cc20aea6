"""Writes a file safely, even if several processes write it at the same time."""

from pathlib import Path

from quarc_ref.files import write_file


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file and its parent folders; the file becomes visible only when it is complete.

    If several processes write the same file, it contains the data of the last one to finish.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, data)
