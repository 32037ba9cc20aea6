import os
import re
import shutil
from statistics import mean

import pytest

from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import TINY_OPTIONS, list_names, make_folder, read_json, run, run_json
from tests.datasets import scenes
from tests.evaluation.capture_streams import write_stream
from tests.small_streams import rebuild_stream


@pytest.fixture(scope="module")
def output_and_report(encoded_stream, capture, tmp_path_factory):
    """The JSON output of `eval --report`, and the folder of the report."""
    folder = tmp_path_factory.mktemp("eval") / "report"
    return run_json("eval", encoded_stream.file, capture, "--report", folder), folder


def test_eval_adds_quality_to_what_info_prints(output_and_report, encoded_stream):
    json_output, _ = output_and_report

    assert json_output.items() >= run_json("info", encoded_stream.file).items()
    for metric in ("psnr", "ssim"):
        assert len(json_output[f"{metric}_per_frame"]) == 3
        assert json_output[metric] == pytest.approx(mean(json_output[f"{metric}_per_frame"]))
        assert json_output["metrics"][metric].startswith(metric)
    assert "ssim_inria" in json_output["metrics"]["ssim"]
    assert json_output["quality"]["mean"]["psnr"] == pytest.approx(json_output["psnr"])
    assert [camera["camera"] for camera in json_output["quality"]["cameras"]] == json_output[
        "held_out"
    ]
    assert json_output["quality"]["mean"]["moving_psnr"] > 0
    assert json_output["quality"]["mean"]["flicker"] is not None
    assert 0 < json_output["psnr"] < 60
    assert 0 < json_output["ssim"] < 1


def test_without_three_frames_there_are_no_figures_of_the_moving_region(tmp_path):
    shots = scenes.make_shots()
    folder = scenes.write_n3dv(tmp_path / "short", shots, 2, scenes.make_plane_points())
    cameras = open_capture(folder).cameras
    (tmp_path / "short.quarc").write_bytes(write_stream(cameras, 2))

    quality = run_json("eval", tmp_path / "short.quarc", folder)["quality"]["mean"]
    assert [name for name, value in quality.items() if value is None] == [
        "moving_psnr", "moving_cc_psnr", "static_psnr", "static_cc_psnr",
        "flicker", "truth_flicker",
    ]  # fmt: skip
    (mean_row,) = re.findall("^mean .*", run("eval", tmp_path / "short.quarc", folder).stdout, re.M)
    assert mean_row.split()[-6:] == ["-"] * 6


def test_the_report_is_written_to_the_given_folder(output_and_report):
    json_output, folder = output_and_report

    assert json_output["report"] == str(folder / "index.html")
    assert (folder / "index.html").is_file()
    assert "cam00_0000_truth.png" in list_names(folder)
    assert list_names(folder.parent) == ["report"]


def test_the_means_and_the_report_are_printed(encoded_stream, capture, output_and_report, tmp_path):
    result = run("eval", encoded_stream.file, capture, "--report", tmp_path / "new")

    assert result.exit_code == 0
    psnr = output_and_report[0]["psnr_per_frame"]
    assert f"{mean(psnr):.2f} dB; frame 0 {psnr[0]:.2f}, worst {min(psnr):.2f}" in result.stdout
    assert "measured frames  0 to 2" in result.stdout
    assert "ssim_inria" in result.stdout
    assert re.search(r"^cam00 .*\d$", result.stdout, re.MULTILINE)
    assert re.search(r"^mean .*\d$", result.stdout, re.MULTILINE)
    assert "index.html" in result.stdout


def test_an_existing_report_is_rejected_and_unchanged(encoded_stream, capture, tmp_path):
    (tmp_path / "index.html").write_text("mine")
    result = run("eval", encoded_stream.file, capture, "--report", tmp_path)

    assert result.exit_code == 2
    assert "index.html, which quarc-ref did not create" in result.stderr
    assert (tmp_path / "index.html").read_text() == "mine"


def test_a_report_is_replaced_by_force(encoded_stream, capture, tmp_path):
    make_folder(tmp_path / "report", "old.png")
    result = run("eval", encoded_stream.file, capture, "--report", tmp_path / "report", "--force")

    assert result.exit_code == 0
    assert "old.png" not in list_names(tmp_path / "report")
    assert "index.html" in list_names(tmp_path / "report")


def test_another_capture_is_a_usage_error_and_leaves_no_report(encoded_stream, tmp_path):
    shots = scenes.rename_shots(scenes.make_shots(), ["cam00", "cam01", "cam02", "cam03"])
    other_folder = scenes.write_n3dv(tmp_path / "other", shots, 3, scenes.make_plane_points())
    result = run("eval", encoded_stream.file, other_folder, "--report", tmp_path / "report")

    assert result.exit_code == 2
    assert "the cameras of the capture and those of the stream differ" in result.stderr
    assert list_names(tmp_path) == ["other"]


@pytest.fixture(scope="module")
def other_capture(capture, tmp_path_factory):
    """A capture with the same cameras and sizes, but one different picture."""
    folder = shutil.copytree(capture, tmp_path_factory.mktemp("other") / "plane")
    shutil.copy(folder / "cam01.mp4", folder / "cam00.mp4")
    return folder


def test_a_stream_of_another_capture_is_rejected(encoded_stream, other_capture, tmp_path):
    result = run("eval", encoded_stream.file, other_capture, "--report", tmp_path / "report")

    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("quarc-ref: the stream was made from another capture")
    assert "--other-capture" in result.stderr
    assert result.stderr.count("\n") == 1
    assert list_names(tmp_path) == []


def test_json_names_the_capture_that_a_stream_was_made_from(encoded_stream, capture, other_capture):
    result = run("eval", encoded_stream.file, other_capture, "--json")
    json_output = read_json(result.stdout)

    assert result.exit_code == 2
    assert json_output["same_capture"] is False
    assert json_output["encoded_from"] == encoded_stream.json_output["metadata"]["fingerprint"]
    assert json_output["fingerprint"] not in ("", json_output["encoded_from"])
    assert "psnr" not in json_output
    assert run_json("eval", encoded_stream.file, capture)["same_capture"] is True


def test_a_stream_of_another_capture_is_measured_on_request_with_a_warning(
    encoded_stream, other_capture
):
    result = run("eval", encoded_stream.file, other_capture, "--json", "--other-capture", "--quiet")
    json_output = read_json(result.stdout)

    assert result.exit_code == 0
    assert result.stderr.startswith("quarc-ref: the stream was made from another capture")
    assert result.stderr.count("\n") == 1
    assert json_output["same_capture"] is False
    assert json_output["psnr"] > 0


def test_a_stream_that_does_not_name_its_capture_is_measured_with_a_warning(
    encoded_stream, capture, tmp_path
):
    chunks = split_chunks(encoded_stream.file.read_bytes())
    changed_chunks = [
        (chunk.kind, chunk.payload.replace(b"fingerprint", b"thumb-print")) for chunk in chunks
    ]
    (tmp_path / "unnamed.quarc").write_bytes(rebuild_stream(changed_chunks))
    result = run("eval", tmp_path / "unnamed.quarc", capture, "--json")

    assert result.exit_code == 0
    assert "the stream has no fingerprint of its capture" in result.stderr
    assert read_json(result.stdout)["same_capture"] is None


@pytest.mark.parametrize("name", ["-", "http://example.org/a.quarc"])
def test_eval_accepts_only_files(name, capture):
    result = run("eval", name, capture)

    assert result.exit_code == 2
    assert "accepts only files" in " ".join(result.stderr.replace("│", " ").split())


def test_eval_reads_a_named_pipe(encoded_stream, capture):
    read_end, write_end = os.pipe()
    with os.fdopen(write_end, "wb") as pipe:
        pipe.write(encoded_stream.file.read_bytes())
    json_output = run_json("eval", f"/dev/fd/{read_end}", capture)
    os.close(read_end)

    assert json_output["frames"] == 3


def test_an_unreadable_capture_is_a_failure_of_the_tool(encoded_stream, capture, tmp_path):
    broken_capture = shutil.copytree(capture, tmp_path / "broken")
    (broken_capture / "cam01.mp4").write_bytes(b"no video")
    result = run("eval", encoded_stream.file, broken_capture)

    assert result.exit_code == 3
    assert "cam01" in result.stderr


def test_a_damaged_stream_is_rejected(encoded_stream, capture, tmp_path):
    (tmp_path / "cut.quarc").write_bytes(encoded_stream.file.read_bytes()[:-1])
    result = run("eval", tmp_path / "cut.quarc", capture)

    assert result.exit_code == 1
    assert "truncated" in result.stderr


def test_a_stream_of_later_frames_is_measured_on_these_frames(capture, tmp_path):
    file = tmp_path / "later.quarc"
    run_json("encode", capture, "-o", file, *TINY_OPTIONS, "--start", 1, "--frames", 2)
    json_output = run_json("eval", file, capture)

    assert run_json("info", file)["metadata"]["start"] == "1"
    assert len(json_output["psnr_per_frame"]) == 2
    resumed_run = run("encode", capture, "-o", file, *TINY_OPTIONS, "--frames", 2, "--resume")
    assert resumed_run.exit_code == 2
    assert "start" in resumed_run.stderr


def test_a_start_after_the_last_frame_is_a_usage_error(capture, tmp_path):
    result = run("encode", capture, "-o", tmp_path / "a.quarc", *TINY_OPTIONS, "--start", 3)

    assert result.exit_code == 2
    assert "--start 3: cannot start at frame 3: the capture has 3 frames" in result.stderr
