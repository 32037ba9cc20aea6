"""Compares the files of the suite with generated content, and writes them."""

from pathlib import Path

FOLDERS = ("streams", "traps", "levels", "invalid", "damaged", "resource", "unit")


def list_differing_files(files: dict[str, bytes], root: Path) -> list[str]:
    """Return the names of files that are missing, differ, or do not belong to the suite."""
    differing = [name for name, data in files.items() if not _has_content(root / name, data)]
    existing = [
        path.relative_to(root).as_posix()
        for folder in FOLDERS
        for path in (root / folder).glob("*")
        if path.is_file()
    ]
    return differing + sorted(set(existing) - files.keys())


def write_files(files: dict[str, bytes], names: list[str], root: Path) -> None:
    """Write the named files, and delete those that do not belong to the suite."""
    for name in names:
        path = root / name
        if name not in files:
            path.unlink()
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(files[name])


def _has_content(path: Path, data: bytes) -> bool:
    return path.is_file() and path.read_bytes() == data
