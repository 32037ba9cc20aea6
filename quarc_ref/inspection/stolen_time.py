"""Measures steal time, in which the host of a virtual machine runs other machines.

Speeds measured with much steal time are unreliable.
"""

from dataclasses import dataclass
from pathlib import Path

_STATISTICS = Path("/proc/stat")  # Linux: see proc(5)
_WORKING = (0, 1, 2, 5, 6)  # user, nice, system, interrupts
_STOLEN = 7


@dataclass(frozen=True, slots=True)
class ProcessorTime:
    """Ticks of all CPUs of this machine since it was started.

    Attributes:
        busy: Ticks in which the CPUs were busy.
        stolen: Ticks in which they were ready to run while the host ran other machines.
    """

    busy: int
    stolen: int

    def stolen_share(self, before: "ProcessorTime") -> float:
        """Return the stolen share of the required CPU time since `before`."""
        busy, stolen = self.busy - before.busy, self.stolen - before.stolen
        return stolen / max(1, busy + stolen)


def read_processor_time(statistics: Path = _STATISTICS) -> ProcessorTime | None:
    """Read the current CPU times; return None if the system does not report them."""
    try:
        with statistics.open() as lines:
            ticks = [int(number) for number in lines.readline().split()[1:]]
    except (OSError, ValueError):
        return None
    if len(ticks) <= _STOLEN:
        return None
    return ProcessorTime(sum(ticks[place] for place in _WORKING), ticks[_STOLEN])
