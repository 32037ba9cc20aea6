"""Tests `encode -o -`, and `encode --live`, whose stream can be read while it is written."""

import pytest

from quarc_ref.encoder import encode_stream
from tests.cli.commands import TINY_OPTIONS, list_names, read_json, run


def test_only_the_stream_goes_to_standard_output(capture, encoded_stream):
    result = run("encode", capture, "-o", "-", *TINY_OPTIONS, "-q")

    assert result.exit_code == 0
    assert result.stdout_bytes == encoded_stream.file.read_bytes()


@pytest.mark.parametrize(
    "options",
    [
        ["--json"],
        ["--live"],
        ["--resume"],
        ["--keyframe-interval", "0"],
        ["--keyframe-interval", "x"],
    ],
)
def test_options_that_need_a_file_are_a_usage_error_with_standard_output(options, capture):
    result = run("encode", capture, "-o", "-", *TINY_OPTIONS, *options)

    assert result.exit_code == 2
    assert result.stdout == ""


def test_a_live_encode_can_be_read_while_it_is_written_and_keeps_its_frames(
    capture, encoded_stream, tmp_path, monkeypatch
):
    file, decode_runs = tmp_path / "a.quarc", []
    fit_motion = encode_stream.fit_motion

    def decode_then_fit(*arguments):
        decode_runs.append(
            run("decode", file, "-o", tmp_path / "out", "--recover", "--force", "--json")
        )
        if len(decode_runs) == 2:
            raise KeyboardInterrupt
        return fit_motion(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(encode_stream, "fit_motion", decode_then_fit)
        result = run("encode", capture, "-o", file, *TINY_OPTIONS, "--live")

    assert result.exit_code == 130
    assert result.stderr.splitlines()[-1] == (
        f"quarc-ref: interrupted; {file} contains the finished frames: "
        "use --resume to encode the missing frames"
    )
    files = [read_json(decode_run.stdout)["files"] for decode_run in decode_runs]
    assert files == [["frame_0000.ply"], ["frame_0000.ply", "frame_0001.ply"]]
    expected_data = encoded_stream.file.read_bytes()
    assert expected_data.startswith(file.read_bytes())
    assert run("encode", capture, "-o", file, *TINY_OPTIONS, "--resume").exit_code == 0
    assert file.read_bytes() == expected_data


def test_a_finished_live_encode_equals_any_other(capture, encoded_stream, tmp_path):
    (tmp_path / "a.quarc").write_text("old")
    command = ["encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--live"]
    rejected_run = run(*command)
    text_after_rejection = (tmp_path / "a.quarc").read_text()

    assert (rejected_run.exit_code, text_after_rejection) == (2, "old")
    assert run(*command, "--force").exit_code == 0
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()
    assert list_names(tmp_path) == ["a.quarc"]


@pytest.mark.parametrize("options", [[], ["--live"]])
@pytest.mark.parametrize(
    ("cut_bytes", "message"), [(1, "is incomplete: use --resume to"), (0, "exists: use --force to")]
)
def test_an_existing_stream_without_its_end_is_to_be_resumed(
    capture, encoded_stream, tmp_path, options, cut_bytes, message
):
    file, data = tmp_path / "a.quarc", encoded_stream.file.read_bytes()
    kept_data = data[: len(data) - cut_bytes]
    file.write_bytes(kept_data)
    result = run("encode", capture, "-o", file, *TINY_OPTIONS, *options)

    assert result.exit_code == 2
    assert f"{file} {message}" in result.stderr
    assert file.read_bytes() == kept_data
