import subprocess
import sys

import numpy as np

from quarc_ref.evaluation.peak_memory import measure_peak_mebibytes

ASK = """
from quarc_ref.evaluation.peak_memory import measure_peak_mebibytes
print(measure_peak_mebibytes())
"""


def test_what_was_needed_once_is_told():
    before = measure_peak_mebibytes()
    np.ones(int(before + 64) << 17)

    assert measure_peak_mebibytes() > before + 64


def test_what_the_parent_had_is_not_counted():
    held = np.ones(400 << 17)
    done = subprocess.run([sys.executable, "-c", ASK], capture_output=True, check=True)

    assert 5 < float(done.stdout) < 300 < held.nbytes >> 20
