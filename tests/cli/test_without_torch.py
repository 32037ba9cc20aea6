"""Tests of decoding without the packages for pictures and training."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest
from tests.cli.commands import list_names, read_json
from tests.engines import needs_fast
from tests.small_streams import make_stream

_BLOCKED_PACKAGES = ("torch", "cv2", "matplotlib", "scipy", "numba", "av", "pycolmap", "gsplat")
_PROGRAM = """
import sys
for name in {}:
    sys.modules[name] = None
from quarc_ref.__main__ import main
from quarc_ref.cli import output
output._SECONDS_BETWEEN_LINES = float("inf")  # a slow machine reports no progress
sys.argv = ["quarc-ref", *sys.argv[1:]]
main()
"""


def _run(*arguments, blocked_packages=_BLOCKED_PACKAGES, engine=""):
    program = [sys.executable, "-c", _PROGRAM.format(blocked_packages), *map(str, arguments)]
    environment = os.environ | {"QUARC_REF_ENGINE": engine}
    return subprocess.run(program, capture_output=True, text=True, env=environment, check=False)


@pytest.fixture(scope="module")
def large_file(tmp_path_factory):
    """A stream that is so large that the command recommends the fast engine."""
    path = tmp_path_factory.mktemp("large") / "large.quarc"
    path.write_bytes(make_stream(gaussian_count=9000, frame_count=1)[0])
    return path


@pytest.mark.parametrize(
    "blocked_packages", [_BLOCKED_PACKAGES, (*_BLOCKED_PACKAGES, "constriction")]
)
@pytest.mark.parametrize("verb", ["verify", "info"])
def test_the_state_is_the_same_as_in_this_process(
    verb, blocked_packages, stream_file, small_stream
):
    completed = _run(verb, stream_file, "--json", blocked_packages=blocked_packages)

    assert completed.returncode == 0, completed.stderr
    assert read_json(completed.stdout)["state_sha256"] == compute_digest(
        small_stream.states[-1].scene
    )


def test_every_frame_is_decoded_to_the_same_arrays(stream_file, small_stream, tmp_path):
    completed = _run("decode", stream_file, "--to", "npz", "-o", tmp_path / "out", "--json")

    names = read_json(completed.stdout)["files"]
    assert len(names) == len(small_stream.states)
    for name, state in zip(names, small_stream.states, strict=True):
        with np.load(tmp_path / "out" / name, allow_pickle=False) as arrays:
            assert np.array_equal(arrays["ids"], state.scene.ids)
            assert np.array_equal(arrays["state_positions"], state.scene.positions)
            assert np.array_equal(arrays["state_rotations"], state.scene.rotations)
            assert np.array_equal(arrays["state_codes"], state.scene.codes)


def test_a_damaged_stream_is_rejected_there_too(stream_file, small_stream):
    stream_file.write_bytes(
        small_stream.data[:200] + bytes([small_stream.data[200] ^ 1]) + small_stream.data[201:]
    )
    completed = _run("verify", stream_file)

    assert completed.returncode == 1
    assert "the stream is rejected" in completed.stderr


@pytest.mark.parametrize("arguments", [["bench"], ["verify"], ["decode", "-o", "{out}"]])
def test_a_missing_fast_engine_is_mentioned_once_if_it_would_help(
    arguments, large_file, stream_file, tmp_path
):
    verb, *options = [argument.format(out=tmp_path / "out") for argument in arguments]
    options += ["--force"] * (verb == "decode")
    without = (*_BLOCKED_PACKAGES, "quarc_core")
    reports = _run(verb, large_file, *options, "--json", blocked_packages=without).stderr

    assert reports.count("\n") == 1
    assert reports.startswith("quarc-ref: quarc_core is not installed")
    for finished in (
        _run(verb, stream_file, *options, blocked_packages=without),
        _run(verb, large_file, *options, "--quiet", blocked_packages=without),
    ):
        assert (finished.returncode, finished.stderr) == (0, "")


@needs_fast
def test_nothing_is_mentioned_if_the_fast_engine_is_installed_or_not_wanted(large_file):
    for engine in ("", "fast", "reference"):
        assert _run("verify", large_file, engine=engine).stderr == ""


def test_an_unknown_engine_is_named(stream_file):
    completed = _run("verify", stream_file, engine="warp")

    assert completed.returncode != 0
    assert "QUARC_REF_ENGINE is 'warp'" in completed.stderr


@pytest.mark.parametrize("verb", ["encode", "render", "eval", "synth", "demo"])
def test_verbs_that_need_more_packages_say_which(verb, stream_file, tmp_path):
    arguments = {
        "encode": [tmp_path, "-o", tmp_path / "new.quarc"],
        "render": [stream_file, "-o", tmp_path / "new.mp4"],
        "eval": [stream_file, tmp_path],
        "synth": [tmp_path / "new"],
        "demo": ["-o", tmp_path / "new"],
    }
    completed = _run(verb, *arguments[verb])

    assert completed.returncode == 3
    assert 'pip install ".[encode]"' in completed.stderr
    assert "Traceback" not in completed.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["small.quarc"]


def test_settings_are_listed():
    completed = _run("encode", "--list-settings")

    assert completed.returncode == 0, completed.stderr
    assert "\nmotion.lr " in completed.stdout


def test_without_a_renderer_a_page_is_published_without_a_poster(stream_file, tmp_path):
    completed = _run("publish", stream_file, "-o", tmp_path / "site", "--json")

    assert completed.returncode == 0, completed.stderr
    assert json.loads(completed.stdout)["poster"] is None
    assert "the page has no poster" in completed.stderr
    assert 'pip install ".[media]"' in completed.stderr
    assert list_names(tmp_path / "site") == ["index.html", "quarc-player.js", "stream.quarc"]
