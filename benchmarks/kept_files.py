"""Files that are whole or not there, whoever else writes the same one."""

from pathlib import Path

from quarc_ref.files import write_file


def keep_file(path: Path, data: bytes) -> None:
    """Write a file, and the folders above it, so that it is seen only when it is whole.

    Two processes may do so at once: the last one stays.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, data)
