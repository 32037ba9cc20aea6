"""Hidden names next to a target: `.NAME.0123456789abcdef.part`, or `.old` for a replaced target."""

import re
import secrets
from pathlib import Path

PART, OLD = "part", "old"
_RANDOM = 8  # bytes


def temporary_name(target: Path, purpose: str) -> Path:
    """Return a hidden random path next to a target."""
    target = target.absolute()
    return target.with_name(f".{target.name}.{secrets.token_hex(_RANDOM)}.{purpose}")


def replaced_name(part: Path) -> Path:
    """Return the path to which the existing target is renamed when `part` replaces it."""
    return part.with_suffix(f".{OLD}")


def is_temporary_name(name: str, target_name: str, purpose: str) -> bool:
    """Return whether a file name may come from `temporary_name`."""
    pattern = rf"\.{re.escape(target_name)}\.[0-9a-f]{{{2 * _RANDOM}}}\.{purpose}"
    return re.fullmatch(pattern, name) is not None
