"""What the compiler of kernels loads, and what it leaves to others."""

import subprocess
import sys

import pytest

pytest.importorskip("numba")
pytest.importorskip("scipy")

_SCRIPT = """
import sys
import quarc_ref.format.plane_kernels
assert "scipy.linalg" not in sys.modules

import numba
import numpy as np
invert = numba.njit(lambda matrix: np.linalg.inv(matrix @ matrix))
assert invert(np.diag([1.0, 2.0])).tolist() == [[1, 0], [0, 0.25]]
"""


def test_scipy_is_loaded_only_when_somebody_compiles_what_needs_it():
    subprocess.run([sys.executable, "-c", _SCRIPT], check=True)
