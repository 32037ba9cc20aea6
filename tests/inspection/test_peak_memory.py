import subprocess
import sys

PROGRAM = """
from quarc_ref.inspection.peak_memory import measure_peak_mebibytes
bytes([1]) * MEBIBYTES * (1 << 20)
print(measure_peak_mebibytes())
"""


def _measure_in_process(mebibytes):
    """Return the peak memory of a process that allocates and frees memory, MiB."""
    program = PROGRAM.replace("MEBIBYTES", str(mebibytes))
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    return float(result.stdout)


def test_the_peak_is_kept_after_memory_is_freed():
    assert _measure_in_process(200) > _measure_in_process(0) + 150


def test_memory_of_the_parent_process_is_not_counted():
    allocated = bytes([1]) * (400 << 20)

    assert 5 < _measure_in_process(0) < 300 < len(allocated) >> 20
