"""Symbolic links in the way of written files: their targets must stay unchanged."""

import os

import pytest

from quarc_ref.encoder.resume import checkpoint
from tests.cli.commands import TINY_OPTIONS, list_names, run


@pytest.fixture
def victim(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    file = tmp_path / "elsewhere" / "victim"
    file.write_text("mine")
    return file


@pytest.mark.parametrize("suffix", ["part", "old"])
@pytest.mark.parametrize("verb", ["cut", "decode", "render"])
def test_a_link_at_a_temporary_name_is_neither_followed_nor_an_obstacle(
    verb, suffix, stream_file, victim, tmp_path
):
    out = tmp_path / "made" / ("out.quarc" if verb == "cut" else "out")
    out.parent.mkdir()
    link = out.with_name(f".{out.name}.{os.getpid()}.{suffix}")
    link.symlink_to(victim)
    frames = ["--frames", ":"]
    result = run(verb, stream_file, "-o", out, *frames, *(["--to", "png"] * (verb == "render")))

    assert result.exit_code == 0, result.stderr
    assert victim.read_text() == "mine"
    assert list_names(out.parent) == sorted([out.name, link.name])
    assert not out.is_symlink()


@pytest.mark.parametrize("options", [[], ["--resume"], ["--force"]])
@pytest.mark.parametrize("dangles", [False, True])
def test_an_encode_does_not_write_through_a_link_at_its_part(
    options, dangles, capture, victim, tmp_path
):
    if dangles:
        victim.unlink()
    (tmp_path / "a.quarc.part").symlink_to(victim)
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, *options)

    assert result.exit_code == 2
    assert "a.quarc.part is a symbolic link" in result.stderr
    assert victim.exists() != dangles
    assert dangles or victim.read_text() == "mine"


def test_the_checkpoint_is_kept_next_to_a_link_at_its_old_temporary_name(
    capture, encoded_stream, victim, tmp_path, monkeypatch
):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)
    link = tmp_path / "a.quarc.part.training.part"
    link.symlink_to(victim)

    assert run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS).exit_code == 0
    assert victim.read_text() == "mine"
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()


def test_a_link_at_the_target_is_replaced_by_force_and_not_followed(stream_file, victim, tmp_path):
    target = tmp_path / "a.quarc"
    target.symlink_to(victim)
    command = ["cut", stream_file, "--frames", ":", "-o", target]
    rejected_run = run(*command)
    forced_run = run(*command, "--force")

    assert (rejected_run.exit_code, forced_run.exit_code) == (2, 0)
    assert victim.read_text() == "mine"
    assert not target.is_symlink()


def test_a_named_pipe_in_place_of_a_checkpoint_does_not_block(capture, encoded_stream, tmp_path):
    os.mkfifo(tmp_path / "a.quarc.part.training")
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--resume")

    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()
