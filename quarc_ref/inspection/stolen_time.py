"""Steal time: how long a virtual machine waits while its host runs others on its processors.

A speed measured during such waits says little about the decoder, and only this figure reveals
them.
"""

from dataclasses import dataclass
from pathlib import Path

_STATISTICS = Path("/proc/stat")  # of Linux: proc(5)
_WORKING = (0, 1, 2, 5, 6)  # user, nice, system, interrupts
_STOLEN = 7


@dataclass(frozen=True, slots=True)
class ProcessorTime:
    """Ticks of all processors of this machine since it was started.

    Attributes:
        worked: Ticks in which the processors ran something.
        stolen: Ticks in which they were ready to run, but the host ran other machines.
    """

    worked: int
    stolen: int

    def stolen_share(self, before: "ProcessorTime") -> float:
        """Return the share that was stolen of the time since `before` that was needed."""
        worked, stolen = self.worked - before.worked, self.stolen - before.stolen
        return stolen / max(1, worked + stolen)


def read_processor_time(statistics: Path = _STATISTICS) -> ProcessorTime | None:
    """Return the processor times so far; None if the system does not report them."""
    try:
        with statistics.open() as lines:
            ticks = [int(number) for number in lines.readline().split()[1:]]
    except (OSError, ValueError):
        return None
    if len(ticks) <= _STOLEN:
        return None
    return ProcessorTime(sum(ticks[place] for place in _WORKING), ticks[_STOLEN])
