"""Tests that an output path with a file suffix is written as a file, not as a folder."""

import pytest

from quarc_ref.datasets.stills import read_still
from quarc_ref.decoder import dequantize
from quarc_ref.export.gaussian_ply import build_ply
from tests.cli.commands import TINY_OPTIONS, list_names, run, run_json


def test_one_frame_is_decoded_into_the_named_file(stream_file, small_stream, tmp_path):
    json_output = run_json("decode", stream_file, "-o", tmp_path / "one.ply", "--frames", "2:3")

    assert json_output == {"folder": str(tmp_path), "files": ["one.ply"], "sidecar": None}
    expected_data = build_ply(dequantize(small_stream.states[2].scene))
    assert (tmp_path / "one.ply").read_bytes() == expected_data
    assert list_names(tmp_path) == ["one.ply", "small.quarc"]


@pytest.mark.parametrize("options", [[], ["--to", "npz"]])
def test_the_suffix_selects_the_format_of_a_frame(options, stream_file, tmp_path):
    run_json("decode", stream_file, "-o", tmp_path / "one.NPZ", "--frames", "3:", *options)

    assert (tmp_path / "one.NPZ").read_bytes().startswith(b"PK")


@pytest.mark.parametrize("name", ["one.ply", "one.npz"])
@pytest.mark.parametrize("options", [[], ["--frames", "1:3"], ["--follow"]])
def test_several_frames_cannot_be_written_into_one_file(options, name, stream_file, tmp_path):
    result = run("decode", stream_file, "-o", tmp_path / name, *options)

    assert result.exit_code == 2
    assert "single file" in result.stderr
    assert "--frames" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


def test_a_name_that_contradicts_to_is_rejected(stream_file, tmp_path):
    result = run("decode", stream_file, "-o", tmp_path / "a.ply", "--to", "npz", "--frames", ":1")

    assert result.exit_code == 2
    assert "--to npz" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


def test_an_existing_file_is_replaced_only_with_force(stream_file, tmp_path):
    (tmp_path / "one.ply").write_text("mine")
    command = ["decode", stream_file, "-o", tmp_path / "one.ply", "--frames", ":1"]
    rejected_run, text_after_rejection = run(*command), (tmp_path / "one.ply").read_text()
    forced_run = run(*command, "--force")

    assert (rejected_run.exit_code, text_after_rejection, forced_run.exit_code) == (2, "mine", 0)
    assert (tmp_path / "one.ply").read_bytes().startswith(b"ply\n")


def test_a_frame_that_cannot_be_decoded_leaves_no_file(stream_file, small_stream, tmp_path):
    stream_file.write_bytes(small_stream.data[:-60])

    assert run("decode", stream_file, "-o", tmp_path / "a.ply", "--frames", "3:").exit_code == 1
    assert list_names(tmp_path) == ["small.quarc"]


def test_one_frame_is_rendered_into_the_named_picture(stream_file, tmp_path):
    json_output = run_json("render", stream_file, "-o", tmp_path / "a.png", "--frames", "1:2")

    assert (json_output["folder"], json_output["files"]) == (str(tmp_path), ["a.png"])
    assert read_still(tmp_path / "a.png").shape == (48, 64, 3)


@pytest.mark.parametrize("options", [[], ["--to", "png"]])
def test_several_frames_cannot_be_rendered_into_one_picture(options, stream_file, tmp_path):
    result = run("render", stream_file, "-o", tmp_path / "a.png", *options)

    assert result.exit_code == 2
    assert "single file" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


@pytest.mark.parametrize("name", ["a.quarc", "a.mp4", "a.png", "a.html", "A.PLY"])
@pytest.mark.parametrize("verb", ["decode", "render", "synth", "demo", "eval"])
def test_a_file_name_does_not_become_a_folder(
    verb, name, stream_file, encoded_stream, capture, tmp_path
):
    target = tmp_path / name
    lines = {
        "decode": ["decode", stream_file, "-o", target],
        "render": ["render", stream_file, "-o", target, "--to", "png"],
        "synth": ["synth", target, "--width", 16, "--height", 16, "--frames", 1],
        "demo": ["demo", "-o", target, "--frames", 2, *TINY_OPTIONS],
        "eval": ["eval", encoded_stream.file, capture, "--report", target],
    }
    result = run(*lines[verb])

    assert result.exit_code == 2
    assert name in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]
