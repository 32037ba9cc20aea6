import subprocess
import sys
from pathlib import Path

import pytest

import options
from expected_errors import report_errors

_BENCHMARKS = Path(options.__file__).parent


@pytest.mark.parametrize("script", ["capture.py", "encode.py", "rate.py"])
def test_a_folder_that_is_not_a_capture_is_named_without_a_traceback(tmp_path, script):
    command = [sys.executable, _BENCHMARKS / script, tmp_path]
    completed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    assert completed.returncode == 2
    assert completed.stderr.splitlines()[-1].startswith(f"{script}: {tmp_path} is not a capture")
    assert "Traceback" not in completed.stderr


def test_ctrl_c_is_reported_without_a_traceback(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["benchmarks/rate.py"])

    with pytest.raises(SystemExit, match="130"), report_errors():
        raise KeyboardInterrupt
    assert capsys.readouterr().err == "rate.py: interrupted\n"
