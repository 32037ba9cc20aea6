import io
import os
import sys

import pytest

from quarc_ref.cli import encode_job
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder import EncodeOptions, encode, segments
from quarc_ref.encoder.segments import slice_capture
from quarc_ref.encoder.settings.presets import change_setting, choose_preset
from quarc_ref.jobs import JobsError, WorkerPool
from quarc_ref.jobs.job import Outcome
from tests.cli.commands import TINY, TINY_OPTIONS, list_names, make_folder, run, run_json
from tests.streams.edits import join_bytes, list_digests


def _make_command(capture, file, *options):
    return ["encode", capture, "-o", file, *TINY_OPTIONS, "--device", "cpu", *options]


@pytest.fixture(scope="module")
def parts(capture):
    """The streams of frame 0 and of frames 1 and 2, encoded separately."""
    config = choose_preset("main")
    for name, value in TINY.items():
        config = change_setting(config, name, str(value))
    streams = []
    for first_frame, count in ((0, 1), (1, 2)):
        sink = io.BytesIO()
        segment = slice_capture(open_capture(capture), first_frame, count)
        encode(segment, sink, EncodeOptions(config, device="cpu"))
        streams.append(sink.getvalue())
    return streams


def _run_jobs_in_process(function, jobs, pool, report):
    """Run jobs as `run_jobs` does, but in this process."""
    assert pool == WorkerPool(2, (os.cpu_count() or 1) // 2 or 1)
    results = []
    for completed, job in enumerate(jobs, 1):
        results.append(function(job.argument))
        report(job.name, completed, len(jobs))
    return results


def test_segments_are_encoded_separately_and_joined(
    capture, encoded_stream, parts, tmp_path, monkeypatch
):
    monkeypatch.setattr(segments, "run_jobs", _run_jobs_in_process)
    file = tmp_path / "a.quarc"
    json_output = run_json(*_make_command(capture, file, "--segments", 2, "--workers", 2))
    frames = run_json("inspect", file)["per_frame"]

    assert file.read_bytes() == join_bytes(*parts)
    assert [frame["kind"] for frame in frames] == ["canonical", "canonical", "moved"]
    assert list_digests(file.read_bytes())[0] == list_digests(encoded_stream.file.read_bytes())[0]
    assert json_output["metadata"] == encoded_stream.json_output["metadata"]
    assert list_names(tmp_path) == ["a.quarc"]


def test_completed_segments_are_kept_and_partial_ones_resumed(
    capture, parts, tmp_path, monkeypatch
):
    file, folder = tmp_path / "a.quarc", tmp_path / "a.quarc.segments"
    monkeypatch.setattr(segments, "encode_segments", _raise_keyboard_interrupt)
    interrupted_run = run(*_make_command(capture, file, "--segments", 2))
    remaining_names = list_names(tmp_path)
    make_folder(folder, "frames_000000_000001.quarc", "frames_000001_000002.quarc")
    (folder / "frames_000000_000001.quarc").write_bytes(parts[0])
    (folder / "frames_000001_000002.quarc").write_bytes(parts[1][:-200])
    failed_resume = run(*_make_command(capture, file, "--segments", 2, "--resume"))
    rejected_run = run(*_make_command(capture, file, "--segments", 2))
    monkeypatch.undo()
    resumed_run = run(*_make_command(capture, file, "--segments", 2, "--workers", 1, "--resume"))

    assert (interrupted_run.exit_code, remaining_names) == (130, [])
    assert "a.quarc.segments contains the finished frames" in failed_resume.stderr
    assert (rejected_run.exit_code, "use --resume to continue" in rejected_run.stderr) == (2, True)
    assert resumed_run.exit_code == 0
    assert file.read_bytes() == join_bytes(*parts)
    assert list_names(tmp_path) == ["a.quarc"]


def test_a_forced_start_replaces_what_an_encode_without_segments_left(
    capture, parts, tmp_path, monkeypatch
):
    def keep_a_segment_and_interrupt(segment_list, *_arguments):
        segment_list[0].file.write_bytes(parts[0])
        raise KeyboardInterrupt

    file = tmp_path / "a.quarc"
    for name in ("a.quarc.part", "a.quarc.part.training"):
        (tmp_path / name).write_bytes(parts[0][:-20])
    monkeypatch.setattr(segments, "encode_segments", keep_a_segment_and_interrupt)
    run(*_make_command(capture, file, "--segments", 2, "--force"))
    remaining_names = list_names(tmp_path)
    resumed_run = run(*_make_command(capture, file, "--segments", 2, "--resume"))

    assert not [name for name in remaining_names if ".part" in name]
    assert "a.quarc.segments contains the finished frames" in resumed_run.stderr


def test_segments_of_another_encode_are_rejected_before_the_others_are_encoded(
    capture, parts, tmp_path, monkeypatch
):
    monkeypatch.setattr(segments, "encode_segments", _raise_keyboard_interrupt)
    folder = tmp_path / "a.quarc.segments"
    make_folder(folder, "frames_000000_000001.quarc", "frames_000001_000002.quarc")
    (folder / "frames_000000_000001.quarc").write_bytes(parts[0][:20])  # damaged
    (folder / "frames_000001_000002.quarc").write_bytes(parts[1])
    command = _make_command(capture, tmp_path / "a.quarc", "--segments", 2, "--resume")
    result = run(*command, "--set", "motion.lr=0.5")

    assert result.exit_code == 2
    assert "these differ: motion.lr; encode to another file" in result.stderr


@pytest.mark.parametrize("suffix", ["", ".training"])
def test_segments_of_another_split_are_not_discarded(capture, parts, tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(segments, "encode_segments", _raise_keyboard_interrupt)
    file, name = tmp_path / "a.quarc", f"frames_000001_000002.quarc{suffix}"
    folder = make_folder(tmp_path / "a.quarc.segments", name)
    (folder / name).write_bytes(parts[1])
    other_run = run(*_make_command(capture, file, "--segments", 3, "--resume"))
    same_run = run(*_make_command(capture, file, "--segments", 2, "--resume"))

    assert other_run.exit_code == 2
    assert f"other frames, such as {name}: use the same --segments" in other_run.stderr
    assert (folder / name).read_bytes() == parts[1]
    assert same_run.exit_code == 130


@pytest.mark.parametrize(
    ("suffix", "content", "message"),
    [
        ("", b"", "interrupted; nothing new was written"),
        (
            ".training",
            b"x",
            "a.quarc.segments contains the training state of frame 0: use --resume",
        ),
        ("", b"x", "a.quarc.segments contains the finished frames: use --resume"),
    ],
)
def test_an_interruption_names_what_is_kept(
    suffix, content, message, capture, tmp_path, monkeypatch
):
    def write_and_interrupt(segment_list, *_arguments):
        file = segment_list[0].file
        file.with_name(file.name + suffix).write_bytes(content)
        raise KeyboardInterrupt

    monkeypatch.setattr(segments, "encode_segments", write_and_interrupt)
    result = run(*_make_command(capture, tmp_path / "a.quarc", "--segments", 2))

    assert result.exit_code == 130
    assert message in result.stderr


def _raise_keyboard_interrupt(*_arguments):
    raise KeyboardInterrupt


def test_a_finished_file_is_unchanged(capture, parts, tmp_path):
    file = tmp_path / "a.quarc"
    file.write_bytes(join_bytes(*parts))
    modified_before = file.stat().st_mtime_ns
    command = _make_command(capture, file, "--segments", 2, "--resume")

    assert run(*command).exit_code == 0
    assert run(*command, "--seed", 1).exit_code == 2
    assert run(*command, "--frames", 2).exit_code == 2
    assert run(*command, "--frames", 4).exit_code == 2
    assert run(*_make_command(capture, file, "--segments", 3, "--resume")).exit_code == 2
    assert file.stat().st_mtime_ns == modified_before
    assert list_names(tmp_path) == ["a.quarc"]


def test_a_failed_segment_is_named_and_the_others_are_kept(capture, tmp_path, monkeypatch):
    def fail(segment_jobs, *_pool):
        segment_jobs[0].file.write_bytes(b"whole")
        raise JobsError({segment_jobs[1].name: Outcome(message="BadMagicError: no stream")}, 2)

    monkeypatch.setattr(segments, "encode_segments", fail)
    result = run(*_make_command(capture, tmp_path / "a.quarc", "--segments", 2))

    assert result.exit_code == 3
    assert (
        f"1 of 2 jobs failed; frames 1 to 2: BadMagicError: no stream; {tmp_path}/a.quarc.segments "
        "contains the finished frames: use --resume"
    ) in result.stderr
    assert list_names(tmp_path) == ["a.quarc.segments"]
    assert list_names(tmp_path / "a.quarc.segments") == ["frames_000000_000001.quarc"]


def test_a_folder_with_other_files_is_not_touched(capture, tmp_path):
    folder = tmp_path / "a.quarc.segments"
    folder.mkdir()
    (folder / "thesis.tex").write_text("mine")
    command = _make_command(capture, tmp_path / "a.quarc", "--segments", 2)
    results = [run(*command, option) for option in ("--force", "--resume")]

    assert [result.exit_code for result in results] == [2, 2]
    assert list_names(folder) == ["thesis.tex"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--segments", 4], "3 frames cannot be split into 4 segments"),
        (["--segments", 0], "--segments"),
        (["--segments", 2, "--live"], "--live"),
        (["--workers", 2], "quarc-ref: --workers needs --segments\n"),
        (["--ray", "auto"], "quarc-ref: --ray needs --segments\n"),
        (["--segments", 2, "--workers", 0], "--workers"),
        (["--segments", 2, "--ray", "auto", "--workers", 2], "--ray auto cannot be combined"),
    ],
)
def test_options_that_segments_do_not_allow_are_a_usage_error_and_write_nothing(
    options, message, capture, tmp_path
):
    result = run(*_make_command(capture, tmp_path / "a.quarc", *options))

    assert result.exit_code == 2
    assert message in result.stderr
    assert list_names(tmp_path) == []


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--segments", 4], 2, "--segments 4: 3 frames cannot be split into 4 segments"),
        (["--segments", 2, "--ray", "auto"], 3, "ray cannot be imported; install it with: pip"),
    ],
)
def test_options_of_segments_are_checked_before_the_capture(
    options, code, message, capture, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.setattr(EncodeOptions, "check", _raise_keyboard_interrupt)
    result = run(*_make_command(capture, tmp_path / "a.quarc", *options))

    assert result.exit_code == code
    assert message in result.stderr
    assert list_names(tmp_path) == []


@pytest.mark.parametrize(
    ("arguments", "cpu_count", "pool"),
    [
        ((4, None, None, "cpu"), 8, WorkerPool(4, 2)),
        ((8, None, None, "cpu"), 4, WorkerPool(4, 1)),
        ((8, 2, None, "auto"), 8, WorkerPool(2, 4)),
        ((2, 16, None, "cpu"), 8, WorkerPool(16, 1)),
        ((2, None, "host:6379", "cpu"), 8, WorkerPool(2, 1, "host:6379")),
        ((2, None, "host:6379", "cuda"), 8, WorkerPool(2, 1, "host:6379", 1.0)),
    ],
)
def test_processors_are_shared_evenly(arguments, cpu_count, pool, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: cpu_count)

    assert encode_job.choose_pool(*arguments) == pool


def test_segments_of_a_cluster_equal_local_ones(capture, parts, tmp_path, ray_cluster):
    file = tmp_path / "a.quarc"
    result = run(*_make_command(capture, file, "--segments", 2, "--ray", ray_cluster))

    assert result.exit_code == 0, result.stderr
    assert file.read_bytes() == join_bytes(*parts)
