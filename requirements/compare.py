"""Compare locked versions with installed ones, or with other locks.

`compare.py FOLDER` looks at what is installed, `compare.py FOLDER OTHER` at the locks of
another folder. Each package that differs gets a line, and the exit code is then 1. Only the
versions for this platform and Python are compared.
"""

import re
import sys
from importlib.metadata import distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

Versions = dict[str, Version]

_UNLOCKED = {"pip", "quarc-core", "quarc-ref"}  # pip comes with the virtual environment
_ENTRY = re.compile(r"^([a-z0-9].*?)[ \\]*$", re.MULTILINE)


def read_locks(folder: Path) -> Versions:
    """Return the version that each package has, for this platform, in the locks of a folder."""
    found = {}
    for lock in sorted(folder.glob("*.txt")):
        for entry in _ENTRY.findall(lock.read_text(encoding="utf-8")):
            requirement = Requirement(entry)
            if requirement.marker is None or requirement.marker.evaluate():
                (pinned,) = requirement.specifier
                found[canonicalize_name(requirement.name)] = Version(pinned.version)
    return found


def list_installed() -> Versions:
    """Return the version of each installed package, without a local part such as `+cpu`."""
    return {
        canonicalize_name(each.name): Version(Version(each.version).public)
        for each in distributions()
    }


def compare(locked: Versions, other: Versions) -> list[str]:
    """Return a line for each package of `other` that is not as locked.

    A locked package may be missing: torch from another index needs no CUDA.
    """
    return [
        f"{name}: {locked.get(name, 'no version')} is locked, {version} is here"
        for name, version in sorted(other.items())
        if name not in _UNLOCKED and locked.get(name) != version
    ]


def main(folder: str, other: str | None = None) -> int:
    """Print every difference, and return the exit code."""
    locked = read_locks(Path(folder))
    lines = compare(locked, read_locks(Path(other)) if other else list_installed())
    print("\n".join(lines) or f"All as locked in {folder}.")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
