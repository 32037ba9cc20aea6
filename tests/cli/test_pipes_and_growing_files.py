import os
import signal
import subprocess
import time

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.streams import decode
from tests.cli.commands import list_names, make_folder, read_json, run, run_json
from tests.cli.processes import SLOW_ENCODER, run_piped, start
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=9, canonical_every=3)
_LAST = compute_digest(_STATES[-1].scene)


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
    cut = run_piped("decode", "-", "-o", tmp_path / "cut", data=_DATA[:-1])
    recovered = run_piped("decode", "-", "-o", tmp_path / "past", "--recover", data=_DATA[:-1])

    assert [item.returncode for item in (completed, cut, recovered)] == [0, 1, 1]
    assert list_names(tmp_path / "out") == ["frame_0004.ply", "frame_0005.ply"]
    assert b"truncated" in cut.stderr
    assert list_names(tmp_path) == ["out", "past"]
    assert len(list_names(tmp_path / "past")) == 9


def test_a_cut_from_pipe_to_pipe_writes_nothing_else():
    completed = run_piped("cut", "-", "--frames", "3:", "-o", "-", data=_DATA)

    assert completed.stderr == b""
    found = [(scene.frame, compute_digest(scene)) for scene in decode(completed.stdout)]
    assert found == [(frame, compute_digest(_STATES[frame].scene)) for frame in range(3, 9)]


def test_a_closed_reader_is_not_a_fault_of_the_stream(tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    (tmp_path / "a.quarc").write_bytes(_DATA)
    with start(
        *("cut", tmp_path / "a.quarc", "--frames", ":", "-o", "-"),
        stdout=writing,
        stderr=subprocess.PIPE,
    ) as cutter:
        os.close(writing)
        message = cutter.communicate(timeout=60)[1]

    assert (cutter.returncode, message) == (128 + signal.SIGPIPE, b"")


@pytest.fixture
def growing_stream(tmp_path):
    """A stream that another process writes, with a frame for every line of its input."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with start(tmp_path / "live.quarc", program=SLOW_ENCODER, **pipes) as encoder:
        assert encoder.stdout.readline() == "0\n"
        yield tmp_path / "live.quarc", encoder
        encoder.kill()


def _next_frame(encoder):
    encoder.stdin.write("\n")
    encoder.stdin.flush()
    return int(encoder.stdout.readline())


def test_a_stream_is_decoded_while_another_process_writes_it(growing_stream, tmp_path):
    path, encoder = growing_stream
    out = tmp_path / "out"
    player = start("decode", path, "-o", out, "--follow", "-q", "--json", stdout=subprocess.PIPE)
    with player:
        for frame in range(3):
            _wait_for((out / f"frame_{frame:04}.ply").exists)
            assert not (out / f"frame_{frame + 1:04}.ply").exists()
            assert player.poll() is None
            assert _next_frame(encoder) == frame + 1
        encoder.stdin.close()
        printed_output = read_json(player.communicate(timeout=60)[0])

    assert player.returncode == 0
    assert (
        printed_output["files"]
        == list_names(out)
        == [f"frame_{frame:04}.ply" for frame in range(4)]
    )
    run("decode", path, "-o", tmp_path / "after")
    for name in printed_output["files"]:
        assert (out / name).read_bytes() == (tmp_path / "after" / name).read_bytes()


def test_a_stream_that_stops_growing_is_truncated_after_the_timeout(growing_stream, tmp_path):
    path, encoder = growing_stream
    _next_frame(encoder)
    started = time.monotonic()
    follow_options = ["--follow", "--patience", "0.3"]
    results = [
        run("verify", path, *follow_options),
        run("verify", path, *follow_options, "--deep"),
        run("decode", path, "-o", tmp_path / "out", *follow_options),
    ]

    assert time.monotonic() - started >= 0.9
    assert [result.exit_code for result in results] == [1, 1, 1]
    assert all("truncated" in result.stderr for result in results)
    assert list_names(tmp_path / "out") == ["frame_0000.ply", "frame_0001.ply"]


def test_a_stream_is_verified_as_it_grows(growing_stream):
    path, encoder = growing_stream
    with start("verify", path, "--follow", "--json", stdout=subprocess.PIPE) as verifier:
        frames = [_next_frame(encoder) for _ in range(2)]
        encoder.stdin.close()
        printed_output = read_json(verifier.communicate(timeout=60)[0])

    assert frames == [1, 2]
    assert (printed_output["valid"], printed_output["frames"]) == (True, 3)


def test_a_killed_encoder_leaves_complete_frames(growing_stream, tmp_path):
    path, encoder = growing_stream
    _next_frame(encoder)
    encoder.kill()
    encoder.wait()
    result = run("decode", path, "-o", tmp_path / "out", "--recover")

    assert result.exit_code == 1
    assert list_names(tmp_path / "out") == ["frame_0000.ply", "frame_0001.ply"]


def test_follow_waits_for_a_stream_that_does_not_exist_yet(tmp_path):
    path, out = tmp_path / "live.quarc", tmp_path / "out"
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with start("decode", path, "-o", out, "--follow", "-q", **pipes) as player:
        assert player.stderr.readline() == f"quarc-ref: waiting for {path}\n"
        assert not out.exists()
        path.write_bytes(b"")
        _wait_for(out.exists)
        path.write_bytes(_DATA)
        player.communicate(timeout=60)

    assert player.returncode == 0
    assert list_names(out) == [f"frame_{frame:04}.ply" for frame in range(9)]


def test_a_stream_that_never_appears_is_reported_and_leaves_nothing(tmp_path):
    path, follow_options = tmp_path / "live.quarc", ["--follow", "--patience", "0.2"]
    missing = [
        run("verify", path, *follow_options),
        run("decode", path, "-o", tmp_path / "out", *follow_options),
    ]
    path.write_bytes(b"")
    empty = [
        run("verify", path, *follow_options),
        run("decode", path, "-o", tmp_path / "out", *follow_options),
    ]

    assert [result.exit_code for result in missing + empty] == [2, 2, 1, 1]
    assert all("does not exist" in result.stderr for result in missing)
    assert all("no new data in 0.2 seconds" in result.stderr for result in empty)
    assert list_names(tmp_path) == ["live.quarc"]


@pytest.mark.parametrize("options", [["--force"], []])
def test_a_followed_folder_is_replaced_only_with_force(options, tmp_path):
    (tmp_path / "a.quarc").write_bytes(make_stream(gaussian_count=5, frame_count=1)[0])
    make_folder(tmp_path / "out", "frame_0007.ply")
    result = run("decode", tmp_path / "a.quarc", "-o", tmp_path / "out", "--follow", *options)

    assert result.exit_code == (0 if options else 2)
    assert list_names(tmp_path / "out") == ["frame_0000.ply" if options else "frame_0007.ply"]
