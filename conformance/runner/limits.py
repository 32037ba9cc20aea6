"""Limits the resources of a process, and measures them."""

import os
import resource
import time
from dataclasses import dataclass
from pathlib import Path

_MIB = 1 << 20
_PAGE = resource.getpagesize()
_DATA_FACTOR = 8


@dataclass(frozen=True)
class Limits:
    """Limits of one case.

    Attributes:
        seconds: On the clock.
        memory_mib: Resident memory of the decoder and its child processes.
    """

    seconds: float = 10.0
    memory_mib: int = 512

    def limit_data(self) -> None:
        """Limit the data size of this process before it becomes the decoder.

        Well above the limit of resident memory, which is measured: some runtimes reserve far more
        than they use.
        """
        most = _DATA_FACTOR * self.memory_mib * _MIB
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Watch:
    """The time and memory of one case.

    Args:
        pid: Of the decoder.
        limits: Limits of the case.
    """

    def __init__(self, pid: int, limits: Limits) -> None:
        self._pid = pid
        self._limits = limits
        self._end = time.monotonic() + limits.seconds

    def fault(self) -> str | None:
        """Return `timeout` or `memory` if a limit is exceeded."""
        if resident_mib(self._pid) > self._limits.memory_mib:
            return "memory"
        return "timeout" if time.monotonic() > self._end else None


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process and its child processes; 0 if unknown."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except (OSError, IndexError):
        return 0.0
    return pages * _PAGE / _MIB + sum(resident_mib(int(child)) for child in children)


def kill_group(pid: int) -> None:
    """Kill the leader of a session, and all processes that it has started."""
    try:
        os.killpg(pid, 9)
    except ProcessLookupError:
        return
