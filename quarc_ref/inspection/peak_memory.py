"""Measures the peak memory of this process."""

import sys
from pathlib import Path

_STATUS_FILE = Path("/proc/self/status")  # Linux: see proc(5)
_MEBIBYTE = 1 << 20


def measure_peak_mebibytes() -> float | None:
    """Return the peak memory of this process so far, MiB; None if the system does not report it.

    `getrusage` is not used on Linux, because its result includes the memory that the parent
    process used when it started this process.
    """
    if _STATUS_FILE.exists():
        for line in _STATUS_FILE.read_text("ascii").splitlines():
            if line.startswith("VmHWM"):
                return int(line.split()[1]) / 1024
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / _MEBIBYTE if sys.platform == "darwin" else peak * 1024 / _MEBIBYTE
