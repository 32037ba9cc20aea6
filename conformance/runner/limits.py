"""Limits the memory and the time that a process may use."""

import os
import resource
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

_MIB = 1 << 20
_PAGE_BYTES = resource.getpagesize()
_DATA_LIMIT_FACTOR = 8


@dataclass(frozen=True)
class Limits:
    """Limits of one case.

    Attributes:
        seconds: Maximum elapsed time.
        memory_mib: Maximum resident memory of the decoder and its child processes, in MiB.
    """

    seconds: float = 10.0
    memory_mib: float = 512.0

    def limit_data_segment(self) -> None:
        """Limit the size of the data segment, in the child process before it starts the decoder.

        This limit is far above the limit of resident memory, because some runtimes reserve much
        more memory than they use.
        """
        limit = int(_DATA_LIMIT_FACTOR * self.memory_mib * _MIB)
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class ResourceMonitor:
    """Checks whether a process exceeds the limits of a case.

    Args:
        pid: Process id of the decoder.
        limits: Limits of the case.
    """

    def __init__(self, pid: int, limits: Limits) -> None:
        self._pid = pid
        self._limits = limits
        self._deadline = time.monotonic() + limits.seconds

    def find_exceeded_limit(self) -> str | None:
        """Return `timeout` or `memory` if that limit is exceeded, otherwise None."""
        if measure_resident_mib(self._pid) > self._limits.memory_mib:
            return "memory"
        return "timeout" if time.monotonic() > self._deadline else None


def measure_resident_mib(pid: int) -> float:
    """Return the resident memory of a process and its child processes in MiB; 0 if unknown."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * _PAGE_BYTES / _MIB + sum(map(measure_resident_mib, _list_children(pid)))


def _list_children(pid: int) -> list[int]:
    """Return the child processes that the threads of a process have started."""
    children: list[str] = []
    with suppress(OSError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError):  # the thread may end at any time
                children += (thread / "children").read_text().split()
    return list(map(int, children))


def kill_process_group(pid: int) -> None:
    """Kill all processes of the process group that `pid` leads."""
    try:
        os.killpg(pid, 9)
    except ProcessLookupError:
        return
