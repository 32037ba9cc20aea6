import json
import re
import shutil

import pytest

from quarc_ref.cli import encode_monitors
from quarc_ref.cli import output as output_module
from quarc_ref.decoder import StreamDecoder
from quarc_ref.encoder.settings.presets import choose_preset
from quarc_ref.encoder.settings.setting_list import describe_settings
from quarc_ref.streams import decode
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import TINY_OPTIONS, list_names, run, run_json
from tests.cli.schemas import validate
from tests.datasets import scenes
from tests.jobs.in_process import run_jobs_in_this_process


def _read_cameras(path):
    decoder = StreamDecoder()
    for chunk in split_chunks(path.read_bytes()):
        decoder.push(chunk)
    return decoder.cameras


def test_a_capture_is_encoded_and_the_stream_verified(encoded_stream):
    assert encoded_stream.json_output["frames"] == 3
    assert run_json("verify", encoded_stream.file) == {
        "valid": True,
        "frames": 3,
        "state_sha256": encoded_stream.json_output["state_sha256"],
    }
    assert len(list(decode(encoded_stream.file.read_bytes()))) == 3


def test_encode_prints_the_same_as_info(encoded_stream):
    assert encoded_stream.json_output["seconds"] > 0
    assert encoded_stream.json_output["file"] == str(encoded_stream.file)
    assert encoded_stream.json_output.items() >= run_json("info", encoded_stream.file).items()


def test_options_of_the_capture_are_applied(capture, tmp_path):
    options = ["--frames", 1, "--downscale", 2, "--held-out", "cam03", "--held-out", "cam01"]
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, *options)

    assert result.exit_code == 0
    assert "seconds" in result.stdout
    cameras = _read_cameras(tmp_path / "a.quarc")
    assert {(camera.width, camera.height) for camera in cameras} == {(24, 16)}
    assert [camera.name for camera in cameras if camera.held_out] == ["cam01", "cam03"]
    assert run_json("verify", tmp_path / "a.quarc")["frames"] == 1


def test_progress_goes_to_stderr(capture, tmp_path, monkeypatch):
    monkeypatch.setattr(output_module, "_SECONDS_BETWEEN_LINES", 0.0)
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--frames", 2)

    lines = result.stderr.splitlines()
    (canonical_line,) = (line for line in lines if line.startswith("canonical 8/8: "))
    (frames_line,) = (line for line in lines if line.startswith("frames 2/2: "))
    assert re.search(r"\d dB train, \d+ Gaussians, \d+ s left$", canonical_line)
    assert re.search(r"\d dB train, \d+ Gaussians, [\d.]+ KB, 0 s left$", frames_line)
    assert "canonical 8/8" not in result.stdout


def test_a_long_encode_forecasts_its_time_and_size_at_the_start(capture, tmp_path, monkeypatch):
    monkeypatch.setattr(encode_monitors, "_MIN_ANNOUNCED_SECONDS", 0.0)
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--frames", 2)

    first_line = result.stderr.splitlines()[0]
    assert re.match(
        r"2 frames of plane, 3 training cameras: about \d+ s, and [\d.]+ MB", first_line
    )


@pytest.mark.parametrize(
    ("byte_count", "text"), [(340, "0.0003"), (2.4e6, "2"), (31e6, "30"), (4.2e9, "4,000")]
)
def test_the_forecast_of_a_size_has_one_digit_and_no_exponent(byte_count, text):
    assert encode_monitors._format_megabytes(byte_count) == text


def test_every_step_and_frame_is_a_line_of_json(capture, encoded_stream, tmp_path):
    log, file = tmp_path / "log.jsonl", tmp_path / "a.quarc"
    assert run("encode", capture, "-o", file, *TINY_OPTIONS, "--log-json", log).exit_code == 0
    lines = [json.loads(line) for line in log.read_text("utf-8").splitlines()]
    for line in lines:
        validate(line)

    events = [line["event"] for line in lines]
    frames = [line for line in lines if line["event"] == "frame"]
    steps = [line for line in lines if line["event"] == "step" and line["stage"] == "canonical"]
    assert events[0] == "begin"
    assert events[-1] == "end"
    assert [frame["frame"] for frame in frames] == [0, 1, 2]
    assert [frame["kind"] for frame in frames] == ["canonical", "moved", "moved"]
    assert [step["step"] for step in steps] == list(range(1, 9))
    assert frames[-1]["gaussians"] == encoded_stream.json_output["gaussians"]
    assert sum(frame["byte_count"] for frame in frames) < file.stat().st_size
    assert file.read_bytes() == encoded_stream.file.read_bytes()


def test_an_existing_log_is_replaced_by_force_and_continued_by_resume(capture, tmp_path):
    log, file = tmp_path / "log.jsonl", tmp_path / "a.quarc"
    log.write_text("mine\n")
    command = ["encode", capture, "-o", file, *TINY_OPTIONS, "--frames", 1, "--log-json", log]

    rejected_run = run(*command)
    assert (rejected_run.exit_code, log.read_text()) == (2, "mine\n")
    assert run(*command, "--resume").exit_code == 0
    assert log.read_text("utf-8").splitlines()[0] == "mine"
    assert run(*command, "--force").exit_code == 0
    assert "mine" not in log.read_text("utf-8")


@pytest.mark.parametrize("option", ["--force", "--resume"])
def test_a_log_survives_a_usage_error(option, capture, tmp_path):
    log, file = tmp_path / "log.jsonl", tmp_path / "a.quarc"
    log.write_text("mine")
    result = run("encode", capture, "-o", file, "--held-out=x", "--log-json", log, option)

    assert (result.exit_code, log.read_text()) == (2, "mine")


def test_tensorboard_shows_losses_and_sizes(capture, encoded_stream, tmp_path):
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    file, folder = tmp_path / "a.quarc", tmp_path / "runs"
    assert run("encode", capture, "-o", file, *TINY_OPTIONS, "--tensorboard", folder).exit_code == 0
    events = EventAccumulator(str(folder))
    events.Reload()

    assert [event.step for event in events.Scalars("canonical/loss")] == list(range(1, 9))
    assert [event.step for event in events.Scalars("motion/train PSNR")] == list(range(1, 7))
    assert len(events.Scalars("frame/bytes")) == 3
    assert [event.step for event in events.Images("frame/train view")] == [0, 1, 2]
    assert file.read_bytes() == encoded_stream.file.read_bytes()


def test_logs_cannot_be_combined_with_segments(capture, tmp_path):
    result = run(
        "encode", capture, "-o", tmp_path / "a.quarc", "--segments", 2, "--log-json", tmp_path / "l"
    )

    assert result.exit_code == 2
    assert "--segments cannot be combined with --log-json" in result.stderr
    assert list_names(tmp_path) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--set", "motion.momentun=1"], "similar names: motion.momentum"),
        (["--set", "motion.rate=1"], "setting 'motion.rate' is now 'motion.lr'"),
        (["--seek-every", "2"], "--seek-every is now --snapshot-interval"),
        (["--canonical-every=2"], "--canonical-every is now --keyframe-interval"),
        (["--set", "motion.lr"], "KEY=VALUE"),
        (["--set", "quality=30", "--quality", "60"], "--set quality=30 cannot be combined"),
        (["--set", "rd_lambda=2", "--lambda", "3"], "--set rd_lambda=2 cannot be combined"),
        (["--set", "seed=2", "--seed", "3"], "--set seed=2 cannot be combined"),
        (["--format", "1.0", "--set", "stream.updates=true"], "--format 1.0 cannot be combined"),
        (["--set", "motion.iterations=many"], "motion.iterations takes"),
        (["--set", "stream.level_count=9"], "level_count"),
        (["--set", "foo=1"], "no setting 'foo'; encode --list-settings lists all settings"),
        (["--quality", "nan"], "--quality takes a number from 0 to 100, not nan"),
        (["--quality", "101"], "--quality takes a number from 0 to 100, not 101.0"),
        (["--lambda", "0"], "--lambda takes a number above 0, not 0.0"),
        (["--lambda", "-1"], "--lambda takes a number above 0, not -1.0"),
        (["--lambda", "nan"], "--lambda takes a number above 0, not nan"),
        (["--lambda", "inf"], "--lambda takes a number above 0, not inf"),
        (["--target-kb-per-frame", "-1"], "--target-kb-per-frame takes a number above 0"),
        (["--target-kb-per-frame", "0"], "--target-kb-per-frame takes a number above 0"),
        (["--target-kb-per-frame", "1e306"], "a number from 0 to 1048576"),
        (["--preset", "fast"], "main, demo"),
        (["--seed", "-1"], "--seed"),
        (["--seed", 1 << 64], "--seed"),
        (["--frames", "0"], "--frames"),
        (["--frames", "4"], "--frames 4: 4 frames are requested, but capture plane has 3"),
        (["--start", "1", "--frames", "3"], "but capture plane has 2 from frame 1 on"),
        (["--frames", "100", "--segments", "2"], "--frames 100: 100 frames are requested"),
        (["--downscale", "0"], "--downscale"),
        (["--downscale", "1000"], "--downscale 1000"),
        (["--device", "tpu"], "--device"),
    ],
)
def test_a_bad_option_is_a_usage_error_and_writes_nothing(options, message, capture, tmp_path):
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *options)

    assert result.exit_code == 2
    assert message in result.stderr
    assert list_names(tmp_path) == []


@pytest.mark.parametrize("suffix", ["", ".part", ".part.training", ".training"])
def test_a_log_does_not_overwrite_a_file_of_the_encode(suffix, capture, tmp_path):
    log = tmp_path / "folder" / ".." / f"a.quarc{suffix}"
    (tmp_path / "folder").mkdir()
    result = run("encode", capture, "-o", tmp_path / "a.quarc", "--log-json", log, "--force")

    assert result.exit_code == 2
    assert "is a file of the encode to" in result.stderr
    assert list_names(tmp_path) == ["folder"]


@pytest.fixture
def capture_of_uneven_length(capture, tmp_path):
    """A copy of the capture in which the video of one camera is a frame shorter."""
    folder = shutil.copytree(capture, tmp_path / "uneven")
    shot = scenes.make_shots()[2]
    scenes.write_video(folder / "cam03.mp4", [scenes.render(shot, frame) for frame in (0, 1)])
    return folder


@pytest.mark.parametrize("options", [[], ["--segments", 2]])
def test_videos_of_unequal_length_are_cut_to_the_shortest_and_named(
    capture_of_uneven_length, tmp_path, options
):
    file = tmp_path / "a.quarc"
    with run_jobs_in_this_process():  # segments
        result = run("encode", capture_of_uneven_length, "-o", file, *TINY_OPTIONS, *options)

    assert result.exit_code == 0
    assert "warning: cam03 has 2 frames, but the others have 3: only the first" in result.stderr
    assert run_json("info", file)["frames"] == 2


def test_the_common_frames_of_all_videos_are_encoded_and_measured(
    capture_of_uneven_length, tmp_path
):
    file = tmp_path / "a.quarc"
    json_output = run_json(
        "encode", capture_of_uneven_length, "-o", file, *TINY_OPTIONS, "--frames", 2
    )

    assert json_output["frames"] == 2
    assert len(run_json("eval", file, capture_of_uneven_length)["psnr_per_frame"]) == 2


def test_the_settings_are_listed_without_a_capture():
    result = run("encode", "--list-settings")
    rows = [re.split("  +", line) for line in result.stdout.splitlines()]

    assert result.exit_code == 0
    assert rows[0] == ["KEY", "in main", "in demo", "in paper", "values", "description"]
    names = [setting.name for setting in describe_settings(choose_preset("main"))]
    assert [row[0] for row in rows[1:]] == names
    assert "stream.seed" not in names  # the encoder sets it
    (lr_row,) = (row for row in rows if row[0] == "motion.lr")
    assert lr_row[1:-1] == ["0.001", "0.001", "0.0005", "a number of at least 0"]
    assert lr_row[-1].startswith("Learning rate of motion residuals at anchor level 1 (the finest)")


def test_a_missing_device_is_a_usage_error(capture, tmp_path):
    result = run("encode", capture, "-o", tmp_path / "a.quarc", "--device", "cuda")

    assert result.exit_code == 2
    assert "no CUDA device" in result.stderr


def test_a_missing_capture_is_a_usage_error(encoded_stream, tmp_path):
    assert run("encode", tmp_path / "none", "-o", tmp_path / "a.quarc").exit_code == 2
    assert run("encode", encoded_stream.file, "-o", tmp_path / "a.quarc").exit_code == 2


def test_an_unreadable_capture_is_a_failure_of_the_tool_and_leaves_nothing(tmp_path):
    (tmp_path / "empty").mkdir()
    result = run("encode", tmp_path / "empty", "-o", tmp_path / "a.quarc")

    assert result.exit_code == 3
    assert "not a capture in a known layout" in result.stderr
    assert list_names(tmp_path) == ["empty"]


def test_an_existing_output_is_rejected_before_anything_is_read(tmp_path):
    (tmp_path / "a.quarc").write_text("mine")
    (tmp_path / "empty").mkdir()
    result = run("encode", tmp_path / "empty", "-o", tmp_path / "a.quarc")

    assert result.exit_code == 2
    assert "--force" in result.stderr
    assert (tmp_path / "a.quarc").read_text() == "mine"


@pytest.mark.parametrize(("option", "kind"), [("keyframe", "canonical"), ("snapshot", "snapshot")])
def test_every_nth_frame_can_be_a_keyframe_as_the_metadata_states(option, kind, capture, tmp_path):
    every = [f"--{option}-interval", 1, "--frames", 3]
    json_output = run_json("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, *every)
    frames = run_json("inspect", tmp_path / "a.quarc")["per_frame"]

    assert [frame["kind"] for frame in frames] == ["canonical", kind, kind]
    assert f"canonical.{option}_interval=1" in json_output["metadata"]["settings"].split()
    assert run_json("cut", tmp_path / "a.quarc", "--frames", "2:", "-o", tmp_path / "b")["frames"]


def test_format_and_target_size_are_those_of_the_options(capture, encoded_stream, tmp_path):
    file = tmp_path / "a.quarc"
    options = ["--format", "1.0", "--target-kb-per-frame", 1.5, "--frames", 2]
    options += ["--set", "stream.updates=False"]  # does not contradict 1.0
    json_output = run_json("encode", capture, "-o", file, *TINY_OPTIONS, *options)

    headers = [next(decode(path.read_bytes())).header for path in (encoded_stream.file, file)]
    assert [header.updates for header in headers] == [True, False]
    assert "target_kb_per_frame=1.5" in json_output["metadata"]["settings"].split()
