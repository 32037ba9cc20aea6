import os
import signal
import subprocess
import threading
import time

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.streams import decode
from tests.cli.commands import list_names, make_folder, read_json, run, run_json
from tests.cli.processes import SLOW_ENCODER, run_piped, start
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=9, canonical_every=3)
_LAST_DIGEST = compute_digest(_STATES[-1].scene)


def _wait_for(condition):
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("verb", "key"), [("verify", "state_sha256"), ("info", "state_sha256"), ("inspect", "symbols")]
)
def test_a_stream_on_standard_input_is_a_stream(verb, key, tmp_path):
    (tmp_path / "a.quarc").write_bytes(_DATA)
    completed = run_piped(verb, "-", "--json", data=_DATA)

    assert completed.returncode == 0
    assert read_json(completed.stdout)[key] == run_json(verb, tmp_path / "a.quarc")[key]


def test_deep_checks_of_a_pipe_equal_those_of_a_file(tmp_path):
    (tmp_path / "a.quarc").write_bytes(_DATA)
    completed = run_piped("verify", "-", "--deep", "--json", data=_DATA)

    assert read_json(completed.stdout) == run_json("verify", tmp_path / "a.quarc", "--deep")


def test_frames_of_a_pipe_are_decoded_and_faults_named(tmp_path):
    completed = run_piped("decode", "-", "-o", tmp_path / "out", "--frames", "4:6", data=_DATA)
    truncated_run = run_piped("decode", "-", "-o", tmp_path / "cut", data=_DATA[:-1])
    recovered_run = run_piped("decode", "-", "-o", tmp_path / "past", "--recover", data=_DATA[:-1])

    assert [process.returncode for process in (completed, truncated_run, recovered_run)] == [
        0,
        1,
        1,
    ]
    assert list_names(tmp_path / "out") == ["frame_0004.ply", "frame_0005.ply"]
    assert b"truncated" in truncated_run.stderr
    assert list_names(tmp_path) == ["out", "past"]
    assert len(list_names(tmp_path / "past")) == 9


def test_a_cut_from_pipe_to_pipe_writes_nothing_else():
    completed = run_piped("cut", "-", "--frames", "3:", "-o", "-", data=_DATA)

    assert completed.stderr == b""
    frames_and_digests = [
        (scene.frame, compute_digest(scene)) for scene in decode(completed.stdout)
    ]
    assert frames_and_digests == [
        (frame, compute_digest(_STATES[frame].scene)) for frame in range(3, 9)
    ]


def test_a_closed_reader_is_not_a_fault_of_the_stream(tmp_path):
    read_end, write_end = os.pipe()
    os.close(read_end)
    (tmp_path / "a.quarc").write_bytes(_DATA)
    with start(
        *("cut", tmp_path / "a.quarc", "--frames", ":", "-o", "-"),
        stdout=write_end,
        stderr=subprocess.PIPE,
    ) as process:
        os.close(write_end)
        message = process.communicate(timeout=60)[1]

    assert (process.returncode, message) == (128 + signal.SIGPIPE, b"")


@pytest.fixture
def growing_stream(tmp_path):
    """A stream that another process writes: a frame for every line of standard input."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with start(tmp_path / "live.quarc", program=SLOW_ENCODER, **pipes) as encoder:
        assert encoder.stdout.readline() == "0\n"
        yield tmp_path / "live.quarc", encoder
        encoder.kill()


def _write_next_frame(encoder):
    encoder.stdin.write("\n")
    encoder.stdin.flush()
    return int(encoder.stdout.readline())


def test_a_stream_is_decoded_while_another_process_writes_it(growing_stream, tmp_path):
    path, encoder = growing_stream
    folder = tmp_path / "out"
    process = start(
        "decode", path, "-o", folder, "--follow", "-q", "--json", stdout=subprocess.PIPE
    )
    with process:
        for frame in range(3):
            _wait_for((folder / f"frame_{frame:04}.ply").exists)
            assert not (folder / f"frame_{frame + 1:04}.ply").exists()
            assert process.poll() is None
            assert _write_next_frame(encoder) == frame + 1
        encoder.stdin.close()
        json_output = read_json(process.communicate(timeout=60)[0])

    assert process.returncode == 0
    assert (
        json_output["files"]
        == list_names(folder)
        == [f"frame_{frame:04}.ply" for frame in range(4)]
    )
    run("decode", path, "-o", tmp_path / "after")
    for name in json_output["files"]:
        assert (folder / name).read_bytes() == (tmp_path / "after" / name).read_bytes()


def test_a_stream_that_stops_growing_is_truncated_after_the_timeout(growing_stream, tmp_path):
    path, encoder = growing_stream
    _write_next_frame(encoder)
    start_time = time.monotonic()
    follow_options = ["--follow", "--patience", "0.3"]
    results = [
        run("verify", path, *follow_options),
        run("verify", path, *follow_options, "--deep"),
        run("decode", path, "-o", tmp_path / "out", *follow_options),
    ]

    assert time.monotonic() - start_time >= 0.9
    assert [result.exit_code for result in results] == [1, 1, 1]
    assert all("truncated" in result.stderr for result in results)
    assert list_names(tmp_path / "out") == ["frame_0000.ply", "frame_0001.ply"]


def test_a_stream_is_verified_as_it_grows(growing_stream):
    path, encoder = growing_stream
    with start("verify", path, "--follow", "--json", stdout=subprocess.PIPE) as process:
        frames = [_write_next_frame(encoder) for _ in range(2)]
        encoder.stdin.close()
        json_output = read_json(process.communicate(timeout=60)[0])

    assert frames == [1, 2]
    assert (json_output["valid"], json_output["frames"]) == (True, 3)


def test_a_killed_encoder_leaves_complete_frames(growing_stream, tmp_path):
    path, encoder = growing_stream
    _write_next_frame(encoder)
    encoder.kill()
    encoder.wait()
    result = run("decode", path, "-o", tmp_path / "out", "--recover")

    assert result.exit_code == 1
    assert list_names(tmp_path / "out") == ["frame_0000.ply", "frame_0001.ply"]


def test_follow_waits_for_a_stream_that_does_not_exist_yet(tmp_path):
    path, folder = tmp_path / "live.quarc", tmp_path / "out"
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with start("decode", path, "-o", folder, "--follow", "-q", **pipes) as process:
        assert process.stderr.readline() == f"quarc-ref: waiting for {path}\n"
        assert not folder.exists()
        path.write_bytes(b"")
        _wait_for(folder.exists)
        path.write_bytes(_DATA)
        process.communicate(timeout=60)

    assert process.returncode == 0
    assert list_names(folder) == [f"frame_{frame:04}.ply" for frame in range(9)]


def test_help_says_that_follow_waits_for_a_file_and_not_for_a_url():
    words = run("verify", "--help").stdout.replace("│", " ").split()

    assert "or for a file that does not exist yet" in " ".join(words)


@pytest.mark.parametrize("start_bytes", [0, 40, len(_DATA) // 3])
def test_later_frames_are_awaited_even_if_the_stream_has_just_begun(start_bytes, tmp_path):
    path = tmp_path / "live.quarc"
    path.write_bytes(_DATA[:start_bytes])
    timer = threading.Timer(0.5, lambda: path.write_bytes(_DATA))
    timer.start()
    json_output = run_json(
        *("decode", path, "-o", tmp_path / "out", "--follow", "--frames", "4:6", "-q")
    )
    timer.join()

    assert json_output["files"] == list_names(tmp_path / "out")
    assert json_output["files"] == ["frame_0004.ply", "frame_0005.ply"]


def test_a_stream_that_never_appears_is_reported_and_leaves_nothing(tmp_path):
    path, follow_options = tmp_path / "live.quarc", ["--follow", "--patience", "0.2"]
    missing_file_runs = [
        run("verify", path, *follow_options),
        run("decode", path, "-o", tmp_path / "out", *follow_options),
    ]
    path.write_bytes(b"")
    empty_file_runs = [
        run("verify", path, *follow_options),
        run("decode", path, "-o", tmp_path / "out", *follow_options),
    ]

    assert [result.exit_code for result in missing_file_runs + empty_file_runs] == [2, 2, 1, 1]
    assert all("does not exist" in result.stderr for result in missing_file_runs)
    assert all("no new data for 0.2 s" in result.stderr for result in empty_file_runs)
    assert list_names(tmp_path) == ["live.quarc"]


@pytest.mark.parametrize("options", [["--force"], []])
def test_a_followed_folder_is_replaced_only_with_force(options, tmp_path):
    (tmp_path / "a.quarc").write_bytes(make_stream(gaussian_count=5, frame_count=1)[0])
    make_folder(tmp_path / "out", "frame_0007.ply")
    result = run("decode", tmp_path / "a.quarc", "-o", tmp_path / "out", "--follow", *options)

    assert result.exit_code == (0 if options else 2)
    assert list_names(tmp_path / "out") == ["frame_0000.ply" if options else "frame_0007.ply"]
