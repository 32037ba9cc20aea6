"""Tests that `render` limits memory for tiny streams with large pictures and many Gaussians."""

import subprocess

import pytest

from quarc_ref.datasets.video import VideoReader
from quarc_ref.format.records import StreamHeader
from tests.cli.commands import list_names, run, run_json
from tests.cli.processes import start
from tests.covering_streams import make_covering_stream
from tests.marks import thorough
from tests.small_streams import make_stream

_MAX_MEBIBYTES = 1024
_MEASURING_PROGRAM = """
import sys
from quarc_ref.__main__ import main
from quarc_ref.inspection.peak_memory import measure_peak_mebibytes
try:
    main()
finally:
    print(measure_peak_mebibytes())
"""


def _measure_peak_memory(*arguments):
    """Return the peak memory in MiB of a command line in a separate process."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = start(*arguments, program=_MEASURING_PROGRAM, **pipes)
    output_text, error_text = process.communicate(timeout=300)
    assert process.returncode == 0, error_text
    return float(output_text.split()[-1])


@pytest.mark.parametrize(
    ("count", "size", "frames", "name"),
    [
        thorough(60_000, (640, 480), 1, "out"),
        (1 << 18, (3072, 2048), 1, "out"),
        (3000, (3072, 2048), 2, "out.mp4"),
        (3000, (1, 16_384), 1, "out.mp4"),
        thorough(3000, (16_384, 1), 1, "out.mp4"),
        (3000, (32_767, 192), 1, "out"),
    ],
)
def test_a_stream_of_a_kilobyte_is_rendered_within_a_gibibyte(count, size, frames, name, tmp_path):
    data = make_covering_stream(count, *size, frames)
    (tmp_path / "s.quarc").write_bytes(data)

    assert len(data) <= 1024
    assert (
        _measure_peak_memory("render", tmp_path / "s.quarc", "-o", tmp_path / name) < _MAX_MEBIBYTES
    )


@pytest.mark.parametrize("size", [(8192, 8192), (3073, 2048)])
def test_pictures_with_more_pixels_are_rendered_only_on_request(size, tmp_path):
    (tmp_path / "s.quarc").write_bytes(make_covering_stream(3000, *size))
    result = run("render", tmp_path / "s.quarc", "-o", tmp_path / "out")

    assert result.exit_code == 2
    assert f"pictures of {size[0]} x {size[1]} have {size[0] * size[1]:,} pixels" in result.stderr
    assert f"--max-pixels {size[0] * size[1]}" in result.stderr
    assert list_names(tmp_path) == ["s.quarc"]


def test_the_limit_of_pixels_can_be_set(stream_file, tmp_path):
    options = ("render", stream_file, "--frames", ":1", "--max-pixels")
    rejected_run = run(*options, 64 * 48 - 1, "-o", tmp_path / "out")
    json_output = run_json(*options, 64 * 48, "-o", tmp_path / "out")
    small_output = run_json(*options, 32 * 24, "--width", 32, "-o", tmp_path / "small")

    assert rejected_run.exit_code == 2
    assert (json_output["width"], json_output["height"]) == (64, 48)
    assert (small_output["width"], small_output["height"]) == (32, 24)


@pytest.mark.parametrize("size", [(1, 100_000), (100_000, 1), (1 << 31, 1 << 31)])
def test_pictures_cannot_exceed_the_limits_of_picture_files(size, tmp_path):
    (tmp_path / "s.quarc").write_bytes(make_covering_stream(10, *size))
    result = run("render", tmp_path / "s.quarc", "-o", tmp_path / "o", "--max-pixels", 1 << 62)

    assert result.exit_code == 2
    assert "the limits are 32,767 pixels per side" in result.stderr


def test_a_large_video_has_the_rendered_pictures(tmp_path):
    (tmp_path / "s.quarc").write_bytes(make_covering_stream(20, 2048, 1026, frames=5))
    run_json("render", tmp_path / "s.quarc", "-o", tmp_path / "o.mp4")
    reader = VideoReader(tmp_path / "o.mp4")

    assert (reader.width, reader.height, reader.frame_count) == (2048, 1026, 5)
    assert reader.read(4).mean() > 100


@pytest.mark.parametrize("frame_rate", [((1 << 32) - 1, 1), (1, 1 << 31)])
def test_a_frame_rate_that_no_video_can_have_is_rejected(frame_rate, tmp_path):
    header = StreamHeader(timescale=frame_rate[0], frame_ticks=frame_rate[1])
    (tmp_path / "s.quarc").write_bytes(make_stream(header)[0])
    result = run("render", tmp_path / "s.quarc", "-o", tmp_path / "o.mp4")

    assert result.exit_code == 2
    assert "frames per second" in result.stderr
    assert run_json("render", tmp_path / "s.quarc", "-o", tmp_path / "o")["frames"] == 4
