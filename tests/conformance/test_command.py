import io
import json
import os
import runpy
import subprocess
import sys
import types
from dataclasses import fields

import pytest

from quarc_ref.conformance.jobs import answer_jobs
from quarc_ref.decoder import compute_digest
from quarc_ref.decoder.dequantize import Splats, dequantize
from tests.small_streams import make_stream

_STREAM, _STATES = make_stream()


@pytest.mark.parametrize(("data", "code"), [(_STREAM, 0), (_STREAM[:-1], 1)])
def test_the_command_returns_an_exit_code(data, code, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", types.SimpleNamespace(buffer=io.BytesIO(data)))
    monkeypatch.setattr(sys, "argv", ["quarc_ref.conformance"])

    with pytest.raises(SystemExit) as exit_info:
        runpy.run_module("quarc_ref.conformance", run_name="__main__")

    assert exit_info.value.code == code
    assert len(capsys.readouterr().out.splitlines()) == len(_STATES) + code


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pipe whose reader is closed")
@pytest.mark.parametrize("option", ["--capabilities", "--jobs", "--coder=python"])
def test_without_a_reader_the_command_ends_silently(option):
    read_end, write_end = os.pipe()
    os.close(read_end)
    data = b'{"job": "number", "function": "?", "input": null}\n' if option == "--jobs" else _STREAM

    completed = subprocess.run(
        [sys.executable, "-m", "quarc_ref.conformance", option],
        input=data,
        stdout=write_end,
        stderr=subprocess.PIPE,
        check=False,
    )
    os.close(write_end)

    assert (completed.returncode, completed.stderr) == (141, b"")


@pytest.mark.parametrize(
    "line",
    ["malformed", "", "null", "[]", "[" * 100_000, '{"job": 5}']
    + [f'{{"job": "decode", {field}}}' for field in ('"bytes": -1', '"bytes": 9', '"start": "4"')]
    + [f'{{"job": "decode", "bytes": {1 << shift}}}' for shift in (62, 70)]
    + [
        f'{{"job": "unit", "function": "isqrt", "input": {value}}}'
        for value in ("null", "[]", "{}", '{"v": "x"}', '{"v": 1e400}', '{"v": 4, "w": 4}')
    ],
)
def test_a_malformed_job_ends_the_command_with_a_message(line, monkeypatch, capsys):
    requests = types.SimpleNamespace(buffer=io.BytesIO(line.encode() + b"\n"))
    monkeypatch.setattr(sys, "stdin", requests)
    monkeypatch.setattr(sys, "argv", ["quarc_ref.conformance", "--jobs"])

    with pytest.raises(SystemExit) as exit_info:
        runpy.run_module("quarc_ref.conformance", run_name="__main__")

    assert exit_info.value.code == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("quarc_ref.conformance: ")
    assert output.err.count("\n") == 1


@pytest.mark.parametrize("fields", ["", ', "function": "cube"', ', "function": ["isqrt"]'])
def test_a_unit_job_without_a_known_function_is_unsupported(fields):
    requests, answers = io.BytesIO(f'{{"job": "unit"{fields}}}\n'.encode()), io.StringIO()

    answer_jobs(requests, answers)

    answer, end = map(json.loads, answers.getvalue().splitlines())
    assert list(answer) == ["unsupported"]
    assert end == {"done": True}


@pytest.mark.parametrize(
    ("job", "data"),
    [
        ({"job": "decode", "numbers": True, "values": True, "bytes": len(_STREAM)}, _STREAM),
        (
            {"job": "unit", "function": "dequantize", "input": {"code": 3, "step": "3dcccccd"}},
            b"",
        ),
    ],
)
def test_numbers_are_the_same_on_machines_of_either_byte_order(job, data, monkeypatch):
    little, big = (_answer_with_byte_order(order, job, data, monkeypatch) for order in "<>")

    assert little == big
    assert "refused" not in little


def _answer_with_byte_order(order, job, data, monkeypatch):
    def dequantize_to_order(scene):
        splats = dequantize(scene)
        return Splats(*(getattr(splats, each.name).astype(f"{order}f4") for each in fields(splats)))

    for module in ("jobs", "units"):
        monkeypatch.setattr(f"quarc_ref.conformance.{module}.dequantize", dequantize_to_order)
    answers = io.StringIO()
    answer_jobs(io.BytesIO(json.dumps(job).encode() + b"\n" + data), answers)
    return answers.getvalue()


def test_importing_the_command_does_nothing(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", None)

    module_globals = runpy.run_module("quarc_ref.conformance.__main__")

    assert callable(module_globals["main"])
    assert capsys.readouterr().out == ""


def test_the_command_prints_a_line_for_each_frame():
    program = (
        "import sys\n"
        "for name in ('torch', 'cv2', 'matplotlib', 'numba', 'scipy', 'av'):\n"
        "    sys.modules[name] = None\n"
        "from quarc_ref.conformance.__main__ import main\n"
        "sys.exit(main())\n"
    )
    command = [sys.executable, "-c", program]

    completed = subprocess.run(command, input=_STREAM, capture_output=True, check=True)
    truncated_run = subprocess.run(command, input=_STREAM[:-1], capture_output=True, check=False)

    lines = [json.loads(line) for line in completed.stdout.splitlines()]
    assert [line["sha256"] for line in lines] == [compute_digest(state.scene) for state in _STATES]
    assert [line["gaussians"] for line in lines] == [state.scene.count for state in _STATES]
    assert truncated_run.returncode == 1
    assert json.loads(truncated_run.stdout.splitlines()[-1])["refused"] == "truncated"
