import io
import json
import runpy
import subprocess
import sys
import types

import pytest

from quarc_ref.decoder import compute_digest
from tests.small_streams import make_stream

_DATA, _STATES = make_stream()


@pytest.mark.parametrize(("data", "code"), [(_DATA, 0), (_DATA[:-1], 1)])
def test_the_command_returns_an_exit_code(data, code, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", types.SimpleNamespace(buffer=io.BytesIO(data)))
    monkeypatch.setattr(sys, "argv", ["quarc_ref.conformance"])

    with pytest.raises(SystemExit) as end:
        runpy.run_module("quarc_ref.conformance", run_name="__main__")

    assert end.value.code == code
    assert len(capsys.readouterr().out.splitlines()) == len(_STATES) + code


def test_importing_the_command_does_nothing(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", None)

    loaded = runpy.run_module("quarc_ref.conformance.__main__")

    assert callable(loaded["main"])
    assert capsys.readouterr().out == ""


def test_the_command_prints_a_line_for_each_frame():
    program = (
        "import sys\n"
        "for name in ('torch', 'cv2', 'matplotlib', 'numba', 'scipy', 'av'):\n"
        "    sys.modules[name] = None\n"
        "from quarc_ref.conformance.__main__ import main\n"
        "sys.exit(main())\n"
    )
    run = [sys.executable, "-c", program]

    whole = subprocess.run(run, input=_DATA, capture_output=True, check=True)
    cut = subprocess.run(run, input=_DATA[:-1], capture_output=True, check=False)

    lines = [json.loads(line) for line in whole.stdout.splitlines()]
    assert [line["sha256"] for line in lines] == [compute_digest(s.scene) for s in _STATES]
    assert [line["gaussians"] for line in lines] == [s.scene.count for s in _STATES]
    assert cut.returncode == 1
    assert json.loads(cut.stdout.splitlines()[-1])["refused"] == "truncated"
