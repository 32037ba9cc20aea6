"""Decoding where nothing that makes pictures or trains can be imported."""

import json
import subprocess
import sys

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest

_BLOCKED = ("torch", "cv2", "matplotlib", "scipy", "numba", "av", "pycolmap", "gsplat")
_PROGRAM = """
import sys
for name in {}:
    sys.modules[name] = None
from quarc_ref.cli.app import main
sys.argv = ["quarc-ref", *sys.argv[1:]]
main()
"""


def _run(*arguments, blocked=_BLOCKED):
    program = [sys.executable, "-c", _PROGRAM.format(blocked), *map(str, arguments)]
    return subprocess.run(program, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("blocked", [_BLOCKED, (*_BLOCKED, "constriction")])
@pytest.mark.parametrize("verb", ["verify", "info"])
def test_the_state_is_the_same_as_in_this_process(verb, blocked, stream_file, made):
    done = _run(verb, stream_file, "--json", blocked=blocked)

    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["state_sha256"] == compute_digest(made.states[-1].scene)


def test_every_frame_is_decoded_to_the_same_arrays(stream_file, made, tmp_path):
    done = _run("decode", stream_file, "--to", "npz", "-o", tmp_path / "out", "--json")

    names = json.loads(done.stdout)["files"]
    assert len(names) == len(made.states)
    for name, state in zip(names, made.states, strict=True):
        with np.load(tmp_path / "out" / name, allow_pickle=False) as arrays:
            assert np.array_equal(arrays["ids"], state.scene.ids)
            assert np.array_equal(arrays["state_positions"], state.scene.positions)
            assert np.array_equal(arrays["state_rotations"], state.scene.rotations)
            assert np.array_equal(arrays["state_codes"], state.scene.codes)


def test_a_damaged_stream_is_refused_there_too(stream_file, made):
    stream_file.write_bytes(made.data[:200] + bytes([made.data[200] ^ 1]) + made.data[201:])
    done = _run("verify", stream_file)

    assert done.returncode == 1
    assert "the stream is refused" in done.stderr


@pytest.mark.parametrize("verb", ["encode", "render", "eval", "synth", "demo"])
def test_what_needs_more_says_what_to_install(verb, stream_file, tmp_path):
    arguments = {
        "encode": [tmp_path, "-o", tmp_path / "new.quarc"],
        "render": [stream_file, "-o", tmp_path / "new.mp4"],
        "eval": [stream_file, tmp_path],
        "synth": [tmp_path / "new"],
        "demo": ["-o", tmp_path / "new"],
    }
    done = _run(verb, *arguments[verb])

    assert done.returncode == 3
    assert "pip install 'quarc-ref[encode]'" in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["small.quarc"]


def test_settings_are_listed():
    done = _run("encode", "--list-settings")

    assert done.returncode == 0, done.stderr
    assert "\nmotion.rate " in done.stdout


def test_a_page_says_what_to_install(stream_file):
    done = _run("view", stream_file, "--no-open", blocked=("viser",))

    assert done.returncode == 3
    assert "pip install 'quarc-ref[view]'" in done.stderr
