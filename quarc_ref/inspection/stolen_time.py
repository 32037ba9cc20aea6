"""Measures steal time: CPU time that the host gave to other virtual machines.

If much time is stolen while a speed is measured, the result is unreliable.
"""

from dataclasses import dataclass
from pathlib import Path

_STATISTICS_FILE = Path("/proc/stat")  # Linux: see proc(5)
_BUSY_COLUMNS = (0, 1, 2, 5, 6)  # user, nice, system, irq, softirq
_STEAL_COLUMN = 7


@dataclass(frozen=True, slots=True)
class ProcessorTime:
    """Clock ticks, summed over all CPUs of this machine since it was started.

    Attributes:
        busy: Ticks in which the CPUs were busy.
        stolen: Ticks in which CPUs had work, but the host ran other virtual machines.
    """

    busy: int
    stolen: int

    def stolen_share(self, earlier: "ProcessorTime") -> float:
        """Return the stolen CPU time since `earlier`, divided by the CPU time that was needed."""
        busy, stolen = self.busy - earlier.busy, self.stolen - earlier.stolen
        return stolen / max(1, busy + stolen)


def read_processor_time(statistics_file: Path = _STATISTICS_FILE) -> ProcessorTime | None:
    """Read the current CPU times; return None if the system does not report them."""
    try:
        with statistics_file.open() as file:
            ticks = [int(number) for number in file.readline().split()[1:]]
    except (OSError, ValueError):
        return None
    if len(ticks) <= _STEAL_COLUMN:
        return None
    return ProcessorTime(sum(ticks[column] for column in _BUSY_COLUMNS), ticks[_STEAL_COLUMN])
