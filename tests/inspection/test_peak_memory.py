import subprocess
import sys

ASK = """
from quarc_ref.inspection.peak_memory import measure_peak_mebibytes
bytes([1]) * MEBIBYTES * (1 << 20)
print(measure_peak_mebibytes())
"""


def _measure_in_process(mebibytes):
    """The peak of a separate process that needs some memory for a moment."""
    program = ASK.replace("MEBIBYTES", str(mebibytes))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    return float(done.stdout)


def test_the_peak_is_kept_after_memory_is_freed():
    assert _measure_in_process(200) > _measure_in_process(0) + 150


def test_memory_of_the_parent_process_is_not_counted():
    held = bytes([1]) * (400 << 20)

    assert 5 < _measure_in_process(0) < 300 < len(held) >> 20
