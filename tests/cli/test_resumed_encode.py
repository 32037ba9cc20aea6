"""Encodes that fail or are interrupted, and what they leave for `--resume`."""

import errno
import signal
import subprocess
import sys

import pytest

from quarc_ref.encoder import encode_stream
from quarc_ref.encoder.resume import checkpoint
from tests.cli.commands import TINY_OPTIONS, list_names, run, run_json
from tests.encoder.resume.saved import read_checkpoint_arrays

_TALKATIVE = """
import sys
from quarc_ref.cli import app, output
output._SECONDS_BETWEEN_LINES = 0.0
sys.argv = ["quarc-ref", *sys.argv[1:]]
app.main()
"""


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (KeyboardInterrupt(), 130, "use --resume to"),
        (OSError(errno.ENOSPC, "No space left on device"), 3, "No space left"),
        (RuntimeError("out of memory"), 3, "out of memory"),
    ],
)
def test_a_failed_encode_keeps_the_old_file_and_a_part_to_resume(
    error, code, message, capture, encoded_stream, tmp_path
):
    (tmp_path / "old.quarc").write_text("mine")
    command = ["encode", capture, *TINY_OPTIONS, "-o"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encode_stream, "fit_births", _failing(error))
        results = [run(*command, tmp_path / name, "--force") for name in ("old.quarc", "new.quarc")]
    remaining_names = list_names(tmp_path)
    second_run = [run(*command, tmp_path / name) for name in ("old.quarc", "new.quarc")]
    resumed_run = [
        run(*command, tmp_path / "old.quarc", "--resume", "--force"),
        run(*command, tmp_path / "new.quarc", "--resume"),
    ]

    assert [result.exit_code for result in results] == [code, code]
    assert all(message in result.stderr for result in results)
    assert remaining_names == ["new.quarc.part", "old.quarc", "old.quarc.part"]
    assert [result.exit_code for result in second_run] == [2, 2]
    assert ["--force" in result.stderr for result in second_run] == [True, True]
    assert [result.exit_code for result in resumed_run] == [0, 0]
    assert list_names(tmp_path) == ["new.quarc", "old.quarc"]
    for name in list_names(tmp_path):
        assert (tmp_path / name).read_bytes() == encoded_stream.file.read_bytes()


def _failing(error):
    def fail(*_arguments):
        raise error

    return fail


@pytest.mark.parametrize("step", ["train_canonical", "fit_births"])
@pytest.mark.parametrize("options", [[], ["--force"], ["--resume"], ["--live", "--force"]])
def test_an_encode_is_not_disturbed_by_another_into_the_same_file(
    step, options, capture, encoded_stream, tmp_path, monkeypatch
):
    pytest.importorskip("fcntl")
    file, others, take_step = tmp_path / "a.quarc", [], getattr(encode_stream, step)
    live = [option for option in options if option == "--live"]
    command = ["encode", capture, *TINY_OPTIONS, "-o", file]

    def begin_another(*arguments):
        monkeypatch.setattr(encode_stream, step, take_step)
        others.append(run(*command, *options))
        return take_step(*arguments)

    monkeypatch.setattr(encode_stream, step, begin_another)
    first = run(*command, *live)

    assert first.exit_code == 0
    assert file.read_bytes() == encoded_stream.file.read_bytes()
    assert [other.exit_code for other in others] == [2]
    assert "being written by another process" in others[0].stderr


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
    contents_before = file.stat().st_mtime_ns
    command = ["encode", capture, "-o", file, *TINY_OPTIONS, "--resume"]
    printed_output = run_json(*command)
    rejected_run = run(*command, "--set", "motion.lr=0.5")

    varying = {"seconds": 0, "file": "", "findings": []}
    assert {**printed_output, **varying} == {**encoded_stream.printed, **varying}
    assert printed_output["findings"] == []
    assert rejected_run.exit_code == 2
    assert rejected_run.stderr.splitlines()[-1].endswith("these differ: motion.lr")
    assert file.stat().st_mtime_ns == contents_before


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_a_training_interrupted_in_its_first_minute_is_kept_to_the_step(ending, capture, tmp_path):
    whole, file = tmp_path / "whole.quarc", tmp_path / "a.quarc"
    training = tmp_path / "a.quarc.part.training"
    long = ["--frames", 1, "--set", "canonical.iterations=400", "--device", "cpu"]
    command = ["encode", capture, *TINY_OPTIONS, *map(str, long), "-o"]
    program = [sys.executable, "-c", _TALKATIVE, *map(str, [*command, file])]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as encoding:
        first = encoding.stderr.readline()
        encoding.send_signal(ending)
        message = encoding.communicate(timeout=60)[1]

    assert first.startswith("canonical 1/400: ")
    assert encoding.returncode == 128 + ending
    assert message.splitlines()[-1] == (
        f"quarc-ref: interrupted; {training} has the training state of frame 0: "
        "use --resume to continue"
    )
    assert list_names(tmp_path) == [training.name]
    assert 0 < read_checkpoint_arrays(training)["step"] < 400
    assert run(*command, whole).exit_code == 0
    assert run(*command, file, "--resume").exit_code == 0
    assert file.read_bytes() == whole.read_bytes()
    assert list_names(tmp_path) == [file.name, whole.name]


def test_an_encode_interrupted_in_frame_0_resumes_its_training(
    capture, encoded_stream, tmp_path, monkeypatch
):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)
    file, training = tmp_path / "a.quarc", tmp_path / "a.quarc.part.training"
    command = ["encode", capture, "-o", file, *TINY_OPTIONS]
    save = checkpoint.Checkpoint.save_if_due

    def save_and_stop(*arguments):
        save(*arguments)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint.Checkpoint, "save_if_due", save_and_stop)
        result = run(*command)

    assert (result.exit_code, list_names(tmp_path)) == (130, [training.name])
    assert result.stderr.splitlines()[-1] == (
        f"quarc-ref: interrupted; {training} has the training state of frame 0: "
        "use --resume to continue"
    )
    rejected_run = run(*command)
    assert rejected_run.exit_code == 2
    assert f"{training} is from an interrupted encode" in rejected_run.stderr
    assert run(*command, "--resume").exit_code == 0
    assert file.read_bytes() == encoded_stream.file.read_bytes()
    assert list_names(tmp_path) == [file.name]


def test_force_discards_a_saved_training(capture, encoded_stream, tmp_path):
    file = tmp_path / "a.quarc"
    (tmp_path / "a.quarc.part.training").write_text("of another")

    assert run("encode", capture, "-o", file, *TINY_OPTIONS, "--force").exit_code == 0
    assert file.read_bytes() == encoded_stream.file.read_bytes()
    assert list_names(tmp_path) == [file.name]
