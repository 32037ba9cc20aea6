"""A small stream and small captures that several tests share; tests must not change them."""

import shutil
from types import SimpleNamespace

import pytest

from tests.cli.commands import TINY_OPTIONS, run_json
from tests.datasets import scenes
from tests.small_streams import make_stream


@pytest.fixture(scope="session", autouse=True)
def _plain_terminal():
    """Disable colors and set 80 columns for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS", "TTY_COMPATIBLE"):
            patch.delenv(name, raising=False)
        patch.setenv("COLUMNS", "80")
        yield


@pytest.fixture(scope="session", autouse=True)
def _no_cuda():
    """Use the CPU for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("torch.cuda.is_available", lambda: False)
        yield


@pytest.fixture(scope="session")
def small_stream():
    """The bytes and the decoded states of a small hand-made stream."""
    data, states = make_stream()
    return SimpleNamespace(data=data, states=states)


@pytest.fixture
def stream_file(small_stream, tmp_path):
    path = tmp_path / "small.quarc"
    path.write_bytes(small_stream.data)
    return path


@pytest.fixture(scope="session")
def capture(tmp_path_factory):
    """A capture of four cameras, 48 x 32, three frames, in N3DV's layout."""
    folder = tmp_path_factory.mktemp("cli") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


@pytest.fixture(scope="session")
def recordings(traced_rig, tmp_path_factory):
    """A folder of three videos without poses, which `calibrate` processes quickly."""
    folder = tmp_path_factory.mktemp("recorded")
    for video in sorted(traced_rig.folder.iterdir())[1:4]:
        shutil.copy(video, folder)
    return folder


@pytest.fixture(scope="session")
def tiny_demo(tmp_path_factory):
    """The folder that `demo --json` wrote, and the JSON output."""
    folder = tmp_path_factory.mktemp("demo") / "out"
    json_output = run_json("demo", "-o", folder, "--frames", 2, *TINY_OPTIONS)
    return SimpleNamespace(folder=folder, json_output=json_output)


@pytest.fixture(scope="session")
def encoded_stream(tmp_path_factory, capture):
    """The stream file that `encode --json` wrote for the capture, and the JSON output."""
    file = tmp_path_factory.mktemp("encoded") / "plane.quarc"
    json_output = run_json("encode", capture, "-o", file, *TINY_OPTIONS)
    return SimpleNamespace(file=file, json_output=json_output)
