"""Tests that a command that reads captures still handles SIGTERM itself."""

import os
import shutil
import subprocess
import sys

import pytest

_PROGRAM = """
import signal
import sys
signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
import quarc_ref.datasets.open_capture
signal.raise_signal(signal.SIGTERM)
"""


@pytest.mark.skipif(os.name != "posix", reason="pycolmap replaces the handler only there")
def test_the_handler_of_sigterm_is_kept_when_pycolmap_is_imported():
    completed = subprocess.run(
        [sys.executable, "-c", _PROGRAM], capture_output=True, timeout=60, check=False
    )

    assert (completed.returncode, completed.stderr) == (7, b"")


_PROGRAM_WITH_SIGNAL_DURING_IMPORT = """
import signal
import sys
signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
signals = [signal.SIGTERM]
def send_signal(event, _arguments):
    if event == "import" and "pycolmap._core" in sys.modules and signals:
        signal.raise_signal(signals.pop())
sys.addaudithook(send_signal)
import quarc_ref.datasets.colmap_import
sys.exit(len(signals))
"""


@pytest.mark.skipif(os.name != "posix", reason="pycolmap replaces the handler only there")
def test_a_signal_during_the_import_of_pycolmap_waits_for_the_handler():
    completed = subprocess.run(
        [sys.executable, "-c", _PROGRAM_WITH_SIGNAL_DURING_IMPORT],
        capture_output=True,
        timeout=60,
        check=False,
    )

    assert (completed.returncode, completed.stderr) == (7, b"")


_PROGRAM_WITHOUT_PYCOLMAP = """
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "pycolmap":
            raise ModuleNotFoundError(name=name)

    def find_distributions(self, context):
        if context.name == "pycolmap":
            raise PackageNotFoundError
        return []

sys.meta_path.insert(0, Finder())
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder.checks.epipolar import find_wrong_poses
capture = open_capture(Path(sys.argv[1]))
print([finding.kind for finding in find_wrong_poses(capture)], capture.image(0, 0).any())
try:
    open_capture(Path(sys.argv[2]))
except ImportError as error:
    print(error.name)
"""


def test_without_pycolmap_only_what_needs_it_fails(n3dv_folder, tmp_path):
    bare = shutil.copytree(n3dv_folder, tmp_path / "bare", ignore=shutil.ignore_patterns("*.ply"))
    completed = subprocess.run(
        [sys.executable, "-c", _PROGRAM_WITHOUT_PYCOLMAP, str(n3dv_folder), str(bare)],
        capture_output=True, text=True, timeout=60, check=True,
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)},
    )  # fmt: skip

    assert completed.stdout == "['epipolar-unchecked'] True\npycolmap\n"
