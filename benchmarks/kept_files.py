"""Files that are whole or not there, whoever else writes the same one."""

import os
from pathlib import Path


def keep_file(path: Path, data: bytes) -> None:
    """Write a file beside its place, and put it there when it is whole.

    Two processes may do so at once: the last one stays.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_bytes(data)
    os.replace(part, path)
