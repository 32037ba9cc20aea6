"""What a process may use, and how much it does use."""

import os
import resource
import time
from dataclasses import dataclass
from pathlib import Path

_MIB = 1 << 20
_PAGE = resource.getpagesize()
_BACKSTOP = 8


@dataclass(frozen=True)
class Limits:
    """What one case may use.

    Attributes:
        seconds: On the clock.
        memory_mib: Resident memory of the decoder and its children.
    """

    seconds: float = 10.0
    memory_mib: int = 512

    def backstop(self) -> None:
        """Bound the data of this process, before it becomes the decoder.

        Well above the bound on resident memory, which is watched: some
        runtimes set aside far more than they use.
        """
        most = _BACKSTOP * self.memory_mib * _MIB
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Watch:
    """The time and memory of one case.

    Args:
        pid: Of the decoder.
        limits: What it may use.
    """

    def __init__(self, pid: int, limits: Limits) -> None:
        self._pid = pid
        self._limits = limits
        self._end = time.monotonic() + limits.seconds

    def fault(self) -> str | None:
        """Return `timeout` or `memory` if a limit has been passed."""
        if resident_mib(self._pid) > self._limits.memory_mib:
            return "memory"
        return "timeout" if time.monotonic() > self._end else None


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process and its children; 0 where it is not told."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except (OSError, IndexError):
        return 0.0
    return pages * _PAGE / _MIB + sum(resident_mib(int(child)) for child in children)


def kill_group(pid: int) -> None:
    """End a process that leads a session, and all that it has started."""
    try:
        os.killpg(pid, 9)
    except ProcessLookupError:
        return
