"""Tests which packages the compiler of kernels loads, and when it compiles."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import quarc_ref

pytest.importorskip("numba")
pytest.importorskip("scipy")

_SCRIPT = """
import sys
import quarc_ref.rendering.compiled
assert "scipy.linalg" not in sys.modules
assert "coverage" not in sys.modules

import numba
import numpy as np
invert = numba.njit(lambda matrix: np.linalg.inv(matrix @ matrix))
assert invert(np.diag([1.0, 2.0])).tolist() == [[1, 0], [0, 0.25]]
"""


def test_scipy_is_loaded_only_to_compile_kernels_that_need_it():
    subprocess.run([sys.executable, "-c", _SCRIPT], check=True)


_CACHE_SCRIPT = """
import sys
import numpy as np
from quarc_ref.encoder.frames.surrogate_kernels import sum_levels
sum_levels(np.ones((3, 2)), np.zeros((1, 4), dtype=np.int64), np.zeros((4, 2)))
print(sum(sum_levels.stats.cache_hits.values()), "numba.np.npyimpl" not in sys.modules)
"""


def test_machine_code_is_compiled_again_after_any_change_of_a_kernel(tmp_path):
    package = tmp_path / "quarc_ref"
    sources = Path(quarc_ref.__file__).parent
    shutil.copytree(sources, package, ignore=shutil.ignore_patterns("__pycache__"))

    def run_script():
        command = [sys.executable, "-c", _CACHE_SCRIPT]
        return subprocess.check_output(command, cwd=tmp_path, text=True).split()

    compiled, cached = ["0", "False"], ["1", "True"]  # cache hits; whether no compiler was loaded
    assert [run_script(), run_script()] == [compiled, cached]
    with (package / "rendering" / "raster_kernels.py").open("a") as file:
        file.write("\n")
    assert [run_script(), run_script()] == [compiled, cached]
