"""Tests of encodes that fail or are interrupted, and of `--resume`."""

import errno
import signal
import subprocess
import sys

import pytest

from quarc_ref.cli import stream_targets
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.encoder import encode_stream
from quarc_ref.encoder.resume import checkpoint
from quarc_ref.inspection import inspect_stream
from tests.cli.commands import TINY_OPTIONS, list_names, run, run_json
from tests.encoder.resume.saved import read_checkpoint_arrays

_PROGRAM_WITH_PROGRESS = """
import sys
from quarc_ref.__main__ import main
from quarc_ref.cli import output
output._SECONDS_BETWEEN_LINES = 0.0
sys.argv = ["quarc-ref", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (KeyboardInterrupt(), 130, "use --resume to"),
        (OSError(errno.ENOSPC, "disk full"), 3, ".part contains the finished frames: use"),
        (RuntimeError("out of memory"), 3, "out of memory"),
        (
            CaptureError("damaged"),
            3,
            "with ignored_frames in quarc-capture.json (quarc-ref doctor prints them) to use only",
        ),
    ],
)
def test_a_failed_encode_keeps_the_old_file_and_a_part_to_resume(
    error, code, message, capture, encoded_stream, tmp_path
):
    (tmp_path / "old.quarc").write_text("mine")
    command = ["encode", capture, *TINY_OPTIONS, "-o"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encode_stream, "fit_births", _make_failing_function(error))
        failed_runs = [
            run(*command, tmp_path / name, "--force") for name in ("old.quarc", "new.quarc")
        ]
    remaining_names = list_names(tmp_path)
    second_runs = [run(*command, tmp_path / name) for name in ("old.quarc", "new.quarc")]
    resumed_runs = [
        run(*command, tmp_path / "old.quarc", "--resume", "--force"),
        run(*command, tmp_path / "new.quarc", "--resume"),
    ]

    assert [result.exit_code for result in failed_runs] == [code, code]
    assert all(message in result.stderr for result in failed_runs)
    assert remaining_names == ["new.quarc.part", "old.quarc", "old.quarc.part"]
    assert [result.exit_code for result in second_runs] == [2, 2]
    assert ["--force" in result.stderr for result in second_runs] == [True, True]
    assert [result.exit_code for result in resumed_runs] == [0, 0]
    assert list_names(tmp_path) == ["new.quarc", "old.quarc"]
    for name in list_names(tmp_path):
        assert (tmp_path / name).read_bytes() == encoded_stream.file.read_bytes()


@pytest.mark.parametrize(
    ("module", "function", "name", "message"),
    [
        (stream_targets, "sync_file", "a.quarc.part", "contains the finished frames"),
        (inspect_stream, "inspect_stream", "a.quarc", "is complete"),
    ],
)
def test_an_interruption_after_the_last_frame_names_the_file_that_was_written(
    module, function, name, message, capture, encoded_stream, tmp_path, monkeypatch
):
    command = ["encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS]
    with monkeypatch.context() as patch:
        patch.setattr(module, function, _make_failing_function(KeyboardInterrupt()))
        result = run(*command)

    assert (result.exit_code, list_names(tmp_path)) == (130, [name])
    assert f"interrupted; {tmp_path / name} {message}" in result.stderr.splitlines()[-1]
    assert (tmp_path / name).read_bytes() == encoded_stream.file.read_bytes()
    assert run(*command, "--resume").exit_code == 0
    assert list_names(tmp_path) == ["a.quarc"]


def _make_failing_function(error):
    def fail(*_arguments):
        raise error

    return fail


@pytest.mark.parametrize("step_name", ["train_canonical", "fit_births"])
@pytest.mark.parametrize("options", [[], ["--force"], ["--resume"], ["--live", "--force"]])
def test_an_encode_is_not_disturbed_by_another_into_the_same_file(
    step_name, options, capture, encoded_stream, tmp_path, monkeypatch
):
    pytest.importorskip("fcntl")
    file, other_runs, run_step = tmp_path / "a.quarc", [], getattr(encode_stream, step_name)
    live_option = [option for option in options if option == "--live"]
    command = ["encode", capture, *TINY_OPTIONS, "-o", file]

    def start_other_encode(*arguments):
        monkeypatch.setattr(encode_stream, step_name, run_step)
        other_runs.append(run(*command, *options))
        return run_step(*arguments)

    monkeypatch.setattr(encode_stream, step_name, start_other_encode)
    first_run = run(*command, *live_option)

    assert first_run.exit_code == 0
    assert file.read_bytes() == encoded_stream.file.read_bytes()
    assert [other_run.exit_code for other_run in other_runs] == [2]
    assert "being written by another process" in other_runs[0].stderr


def test_force_starts_again_although_a_part_exists(capture, encoded_stream, tmp_path):
    (tmp_path / "a.quarc.part").write_text("not a stream")
    command = ["encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS]
    rejected_run = run(*command, "--resume")

    assert rejected_run.exit_code == 1
    assert (tmp_path / "a.quarc.part").read_text() == "not a stream"
    assert run(*command, "--force").exit_code == 0
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()
    assert list_names(tmp_path) == ["a.quarc"]


def test_resume_without_a_part_starts_a_new_encode(capture, encoded_stream, tmp_path):
    command = ["encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--resume"]

    assert run(*command).exit_code == 0
    assert (tmp_path / "a.quarc").read_bytes() == encoded_stream.file.read_bytes()


def test_resume_keeps_a_finished_file_and_rejects_other_settings(capture, encoded_stream, tmp_path):
    file = tmp_path / "a.quarc"
    file.write_bytes(encoded_stream.file.read_bytes())
    modified_before = file.stat().st_mtime_ns
    command = ["encode", capture, "-o", file, *TINY_OPTIONS, "--resume"]
    json_output = run_json(*command)
    rejected_run = run(*command, "--set", "motion.lr=0.5")

    varying_values = {"seconds": 0, "file": "", "findings": []}
    assert {**json_output, **varying_values} == {**encoded_stream.json_output, **varying_values}
    assert json_output["findings"] == []
    assert rejected_run.exit_code == 2
    assert rejected_run.stderr.splitlines()[-1].endswith(
        "these differ: motion.lr; encode to another file, or use --force without --resume to "
        "replace the stream"
    )
    assert file.stat().st_mtime_ns == modified_before


@pytest.mark.parametrize(
    "signal_number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.thorough)]
)
def test_a_training_interrupted_in_its_first_minute_is_kept_to_the_step(
    signal_number, capture, tmp_path
):
    reference_file, file = tmp_path / "whole.quarc", tmp_path / "a.quarc"
    checkpoint_file = tmp_path / "a.quarc.part.training"
    long_options = ["--frames", 1, "--set", "canonical.iterations=400", "--device", "cpu"]
    command = ["encode", capture, *TINY_OPTIONS, *map(str, long_options), "-o"]
    program = [sys.executable, "-c", _PROGRAM_WITH_PROGRESS, *map(str, [*command, file])]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as process:
        first_line = process.stderr.readline()
        process.send_signal(signal_number)
        message = process.communicate(timeout=60)[1]

    assert first_line.startswith("canonical 1/400: ")
    assert process.returncode == 128 + signal_number
    assert message.splitlines()[-1] == (
        f"quarc-ref: interrupted; {checkpoint_file} contains the training state of frame 0: "
        "use --resume to continue"
    )
    assert list_names(tmp_path) == [checkpoint_file.name]
    assert 0 < read_checkpoint_arrays(checkpoint_file)["step"] < 400
    assert run(*command, reference_file).exit_code == 0
    assert run(*command, file, "--resume").exit_code == 0
    assert file.read_bytes() == reference_file.read_bytes()
    assert list_names(tmp_path) == [file.name, reference_file.name]


def test_an_encode_interrupted_in_frame_0_resumes_its_training(
    capture, encoded_stream, tmp_path, monkeypatch
):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)
    file, checkpoint_file = tmp_path / "a.quarc", tmp_path / "a.quarc.part.training"
    command = ["encode", capture, "-o", file, *TINY_OPTIONS]
    save_if_due = checkpoint.Checkpoint.save_if_due

    def save_and_stop(*arguments):
        save_if_due(*arguments)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint.Checkpoint, "save_if_due", save_and_stop)
        result = run(*command)

    assert (result.exit_code, list_names(tmp_path)) == (130, [checkpoint_file.name])
    assert result.stderr.splitlines()[-1] == (
        f"quarc-ref: interrupted; {checkpoint_file} contains the training state of frame 0: "
        "use --resume to continue"
    )
    rejected_run = run(*command)
    assert rejected_run.exit_code == 2
    assert f"{checkpoint_file} is from an interrupted encode" in rejected_run.stderr
    assert run(*command, "--resume").exit_code == 0
    assert file.read_bytes() == encoded_stream.file.read_bytes()
    assert list_names(tmp_path) == [file.name]


def test_force_discards_a_saved_training(capture, encoded_stream, tmp_path):
    file = tmp_path / "a.quarc"
    (tmp_path / "a.quarc.part.training").write_text("of another")

    assert run("encode", capture, "-o", file, *TINY_OPTIONS, "--force").exit_code == 0
    assert file.read_bytes() == encoded_stream.file.read_bytes()
    assert list_names(tmp_path) == [file.name]
