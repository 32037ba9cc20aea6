"""Hidden paths next to a target NAME.

`.NAME.0123456789abcdef.part` is incomplete output; `.NAME.0123456789abcdef.old` is an old target
that is being replaced.
"""

import re
import secrets
from pathlib import Path

PART_SUFFIX, OLD_SUFFIX = "part", "old"
_RANDOM_BYTES = 8


def make_temporary_path(target: Path, suffix: str) -> Path:
    """Return a hidden random path next to a target."""
    target = target.absolute()
    return target.with_name(f".{target.name}.{secrets.token_hex(_RANDOM_BYTES)}.{suffix}")


def make_old_path(part_path: Path) -> Path:
    """Return the path to which the old target is moved when `part_path` takes its place."""
    return part_path.with_suffix(f".{OLD_SUFFIX}")


def is_temporary_name(name: str, target_name: str, suffix: str) -> bool:
    """Return whether `make_temporary_path` can create this file name."""
    pattern = rf"\.{re.escape(target_name)}\.[0-9a-f]{{{2 * _RANDOM_BYTES}}}\.{suffix}"
    return re.fullmatch(pattern, name) is not None
