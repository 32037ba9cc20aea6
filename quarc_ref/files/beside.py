"""Hidden names beside a target: `.NAME.0123456789abcdef.part`, and `.old` for what it replaces."""

import re
import secrets
from pathlib import Path

PART, OLD = "part", "old"
_RANDOM = 8  # bytes


def temporary_name(target: Path, purpose: str) -> Path:
    """Return a random name beside a target."""
    target = target.absolute()
    return target.with_name(f".{target.name}.{secrets.token_hex(_RANDOM)}.{purpose}")


def replaced_name(part: Path) -> Path:
    """Return the name for the replaced target of a temporary file."""
    return part.with_suffix(f".{OLD}")


def is_temporary_name(name: str, target_name: str, purpose: str) -> bool:
    """Return whether a name has the form of those of `temporary_name`."""
    pattern = rf"\.{re.escape(target_name)}\.[0-9a-f]{{{2 * _RANDOM}}}\.{purpose}"
    return re.fullmatch(pattern, name) is not None
