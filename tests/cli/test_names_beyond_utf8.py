"""Tests of file names that are not UTF-8, which Python represents with lone surrogates."""

import shutil

import pytest

from quarc_ref.encoder import encode_stream
from tests.cli.commands import TINY_OPTIONS, list_names, run
from tests.datasets import scenes

_INVALID_CHARACTER = "\udcff"  # how Python represents the byte FF in a file name


@pytest.fixture(autouse=True)
def _disable_training(monkeypatch):
    """Make every training fail, since invalid names must be reported before training."""
    monkeypatch.setattr(encode_stream, "train_canonical", None)


def _run_rejected_encode(folder, tmp_path):
    """Run `encode` on a capture that it must reject, and return the message."""
    result = run("encode", folder, "-o", tmp_path / "a.quarc", *TINY_OPTIONS)

    assert result.exit_code == 3
    assert result.stderr.count("\n") == 1
    assert "--downscale" not in result.stderr
    assert not [name for name in list_names(tmp_path) if name.startswith("a.quarc")]
    return result.stderr


def _copy_capture(capture, target):
    try:
        return shutil.copytree(capture, target)
    except OSError:
        pytest.skip("this file system has no such names")


def test_an_impossible_file_name_is_reported(capture, tmp_path):
    folder = _copy_capture(capture, tmp_path / "film")
    (folder / "poses_bounds.npy").unlink()
    document = scenes.make_video_document(scenes.make_shots(), ply_file_path="points\ud800.ply")
    scenes.write_transforms(folder, document)

    assert "points\\ud800.ply" in _run_rejected_encode(folder, tmp_path)


def test_a_capture_name_that_a_stream_cannot_hold_is_reported(capture, tmp_path):
    folder = _copy_capture(capture, tmp_path / f"film{_INVALID_CHARACTER}")

    assert "'film\\udcff' is not valid UTF-8" in _run_rejected_encode(folder, tmp_path)


def test_a_camera_name_that_a_stream_cannot_hold_is_reported(capture, tmp_path):
    folder = _copy_capture(capture, tmp_path / "film")
    try:
        (folder / "cam03.mp4").rename(folder / f"cam03{_INVALID_CHARACTER}.mp4")
    except OSError:
        pytest.skip("this file system has no such names")

    assert "'cam03\\udcff' is not valid UTF-8" in _run_rejected_encode(folder, tmp_path)


@pytest.mark.parametrize("verb", ["info", "verify"])
def test_a_stream_file_can_have_any_name(verb, stream_file):
    try:
        odd_path = stream_file.rename(stream_file.with_name(f"odd{_INVALID_CHARACTER}.quarc"))
    except OSError:
        pytest.skip("this file system has no such names")

    assert "odd\\udcff.quarc" in run(verb, odd_path).stdout
