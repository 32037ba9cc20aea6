"""Tests that a command that reads captures still handles SIGTERM itself."""

import os
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
