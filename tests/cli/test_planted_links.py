"""Tests that writing an output file does not change targets of existing symbolic links."""

import os

import pytest

from quarc_ref.encoder.resume import checkpoint
from tests.cli.commands import TINY_OPTIONS, list_names, run


@pytest.fixture
def linked_file(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    file = tmp_path / "elsewhere" / "victim"
    file.write_text("mine")
    return file


@pytest.mark.parametrize("suffix", ["part", "old"])
@pytest.mark.parametrize("verb", ["cut", "decode", "render"])
def test_a_link_at_a_temporary_name_is_neither_followed_nor_an_obstacle(
    verb, suffix, stream_file, linked_file, tmp_path
):
    target = tmp_path / "made" / ("out.quarc" if verb == "cut" else "out")
    target.parent.mkdir()
    link = target.with_name(f".{target.name}.{os.getpid()}.{suffix}")
    link.symlink_to(linked_file)
    frames = ["--frames", ":"]
    result = run(verb, stream_file, "-o", target, *frames, *(["--to", "png"] * (verb == "render")))

    assert result.exit_code == 0, result.stderr
    assert linked_file.read_text() == "mine"
    assert list_names(target.parent) == sorted([target.name, link.name])
    assert not target.is_symlink()


@pytest.mark.parametrize("options", [[], ["--resume"], ["--force"]])
@pytest.mark.parametrize("is_dangling", [False, True])
def test_an_encode_does_not_write_through_a_link_at_its_part(
    options, is_dangling, capture, linked_file, tmp_path
):
    if is_dangling:
        linked_file.unlink()
    (tmp_path / "a.quarc.part").symlink_to(linked_file)
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, *options)

    assert result.exit_code == 2
    assert "a.quarc.part is a symbolic link" in result.stderr
    assert linked_file.exists() != is_dangling
    assert is_dangling or linked_file.read_text() == "mine"


def test_the_checkpoint_is_kept_next_to_a_link_at_its_old_temporary_name(
    capture, encoded_stream, linked_file, tmp_path, monkeypatch
):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)
    link = tmp_path / "a.quarc.part.training.part"
    link.symlink_to(linked_file)

    assert run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS).exit_code == 0
    assert linked_file.read_text() == "mine"
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()


def test_a_link_at_the_target_is_replaced_by_force_and_not_followed(
    stream_file, linked_file, tmp_path
):
    target = tmp_path / "a.quarc"
    target.symlink_to(linked_file)
    command = ["cut", stream_file, "--frames", ":", "-o", target]
    rejected_run = run(*command)
    forced_run = run(*command, "--force")

    assert (rejected_run.exit_code, forced_run.exit_code) == (2, 0)
    assert linked_file.read_text() == "mine"
    assert not target.is_symlink()


def test_a_named_pipe_in_place_of_a_checkpoint_does_not_block(capture, encoded_stream, tmp_path):
    os.mkfifo(tmp_path / "a.quarc.part.training")
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--resume")

    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()
