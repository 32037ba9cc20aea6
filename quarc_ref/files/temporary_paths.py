"""Hidden paths next to a target NAME.

`.NAME.0123456789abcdef.part` is incomplete output; `.NAME.0123456789abcdef.old` is an old target
that is being replaced. If NAME is so long that these names would be too long, its SHA-256 stands
for it.
"""

import hashlib
import os
import re
import secrets
from pathlib import Path

PART_SUFFIX, OLD_SUFFIX = "part", "old"
_RANDOM_BYTES = 8
_MAX_NAME_BYTES = 255 - len(f"..{'0' * 2 * _RANDOM_BYTES}.{PART_SUFFIX}")  # of most file systems


def make_temporary_path(target: Path, suffix: str) -> Path:
    """Return a hidden random path next to a target."""
    target = target.absolute()
    random_digits = secrets.token_hex(_RANDOM_BYTES)
    return target.with_name(f".{_shorten(target.name)}.{random_digits}.{suffix}")


def make_old_path(part_path: Path) -> Path:
    """Return the path to which the old target is moved when `part_path` takes its place."""
    return part_path.with_suffix(f".{OLD_SUFFIX}")


def is_temporary_name(name: str, target_name: str, suffix: str) -> bool:
    """Return whether `make_temporary_path` can create this file name."""
    pattern = rf"\.{re.escape(_shorten(target_name))}\.[0-9a-f]{{{2 * _RANDOM_BYTES}}}\.{suffix}"
    return re.fullmatch(pattern, name) is not None


def _shorten(name: str) -> str:
    name_bytes = os.fsencode(name)
    return name if len(name_bytes) <= _MAX_NAME_BYTES else hashlib.sha256(name_bytes).hexdigest()
