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
class Machine:
    """Free resources of a machine.

    Attributes:
        memory_bytes: Free main memory, bytes; None if unknown.
        disk_bytes: Free space on the disk of the current folder, bytes.
    """

    memory_bytes: int | None
    disk_bytes: int


def measure_machine() -> Machine:
    """Return the current free resources of this machine."""
    return Machine(_read_free_memory(), shutil.disk_usage(Path.cwd()).free)


def find_shortages(machine: Machine, memory_bytes: int, disk_bytes: int) -> Iterator[Finding]:
    """Yield a finding if the machine lacks memory, and a finding if it lacks disk space.

    Args:
        machine: Free resources of the machine.
        memory_bytes: Main memory that the encode needs, bytes.
        disk_bytes: Disk space that the encode needs, bytes.
    """
    if machine.memory_bytes is not None and machine.memory_bytes < memory_bytes:
        message = (
            f"encoding needs about {memory_bytes / _GIB:.1f} GiB of memory, but "
            f"{machine.memory_bytes / _GIB:.1f} GiB are free: use --downscale 2, which needs "
            "about a quarter of the memory for pictures, or fewer cameras"
        )
        yield Finding("memory-short", message)
    if machine.disk_bytes < disk_bytes:
        message = (
            f"encoding needs up to {disk_bytes / _GIB:.2f} GiB of disk space, but "
            f"{machine.disk_bytes / _GIB:.2f} GiB are free in {Path.cwd()}: free some space, "
            "or write the stream elsewhere"
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
