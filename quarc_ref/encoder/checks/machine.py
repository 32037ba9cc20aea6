"""Checks whether this machine has the memory and disk space that an encode needs."""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.datasets.findings import Finding

_MEMINFO = Path("/proc/meminfo")  # Linux: see proc(5)
_GIB = 1 << 30


@dataclass(frozen=True, slots=True)
class FreeResources:
    """Free memory and disk space of a machine.

    Attributes:
        memory_bytes: Free main memory, bytes; None if unknown.
        disk_bytes: Free space on the disk of the current folder, bytes.
    """

    memory_bytes: int | None
    disk_bytes: int


def measure_free_resources() -> FreeResources:
    """Return the free memory and disk space of this machine."""
    return FreeResources(_read_free_memory(), shutil.disk_usage(Path.cwd()).free)


def find_shortages(
    free_resources: FreeResources, needed_memory_bytes: int, needed_disk_bytes: int
) -> Iterator[Finding]:
    """Yield one finding if memory is insufficient, and one if disk space is insufficient.

    Args:
        free_resources: Free memory and disk space of the machine.
        needed_memory_bytes: Main memory that the encode needs.
        needed_disk_bytes: Disk space that the encode needs.
    """
    if (
        free_resources.memory_bytes is not None
        and free_resources.memory_bytes < needed_memory_bytes
    ):
        message = (
            f"encoding needs about {needed_memory_bytes / _GIB:.1f} GiB of memory, but "
            f"{free_resources.memory_bytes / _GIB:.1f} GiB are free: use --downscale 2, which "
            "reduces the memory for pictures to about a quarter, or use fewer cameras"
        )
        yield Finding("memory-short", message)
    if free_resources.disk_bytes < needed_disk_bytes:
        message = (
            f"encoding needs up to {needed_disk_bytes / _GIB:.2f} GiB of disk space, but "
            f"{free_resources.disk_bytes / _GIB:.2f} GiB are free in {Path.cwd()}: free some "
            "space, or write the stream elsewhere"
        )
        yield Finding("disk-short", message)


def _read_free_memory() -> int | None:
    if _MEMINFO.exists():
        for line in _MEMINFO.read_text("ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # Windows, macOS
        return None
