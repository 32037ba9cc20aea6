import runpy
import sys
from pathlib import Path

import pytest

import decode
import hostile_bombs
import options
from expected_errors import report_errors
from hostile import command as hostile_command

_BENCHMARKS = Path(options.__file__).parent


@pytest.mark.parametrize("script", ["encode.py", "rate.py"])
def test_a_folder_that_is_not_a_capture_is_named_without_a_traceback(
    tmp_path, monkeypatch, capsys, script
):
    path = str(_BENCHMARKS / script)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [path, str(tmp_path)])

    with pytest.raises(SystemExit, match="2"):
        runpy.run_path(path, run_name="__main__")
    message_lines = capsys.readouterr().err.splitlines()
    assert message_lines[-1].startswith(f"{script}: {tmp_path} is not a capture")


def test_ctrl_c_is_reported_without_a_traceback(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["benchmarks/rate.py"])

    with pytest.raises(SystemExit, match="130"), report_errors():
        raise KeyboardInterrupt
    assert capsys.readouterr().err == "rate.py: interrupted\n"


@pytest.mark.parametrize("module", [decode, hostile_bombs, hostile_command])
def test_a_missing_fast_engine_is_reported_before_anything_runs(monkeypatch, capsys, module):
    monkeypatch.setattr(module, "find_fast_engine", lambda: None)
    monkeypatch.setattr(sys, "argv", ["program.py"])

    with pytest.raises(SystemExit) as exit_info:
        module.main()
    message = f"{exit_info.value} {capsys.readouterr().err}"
    assert "the fast engine" in message
    assert "not installed: see core/README.md" in message
