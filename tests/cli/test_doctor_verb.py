import json
import shutil

import numpy as np
import pytest

from quarc_ref.cli.verbs.doctor import _PIXEL_DESCRIPTIONS, _format_bytes
from tests.cli.commands import read_json, run
from tests.datasets import scenes


@pytest.fixture
def incomplete_capture(capture, tmp_path):
    """A capture without one of its videos."""
    folder = shutil.copytree(capture, tmp_path / "incomplete_capture")
    (folder / "cam03.mp4").unlink()
    return folder


def test_a_capture_that_cannot_be_opened_is_a_finding(incomplete_capture):
    result = run("doctor", incomplete_capture)

    assert result.exit_code == 1
    assert "count-mismatch: " in result.stderr
    assert "4 poses, but there are 3 cameras" in result.stderr


def test_findings_are_in_the_json(incomplete_capture):
    result = run("doctor", incomplete_capture, "--json")
    json_output = read_json(result.stdout)

    assert result.exit_code == 1
    assert (json_output["capture"], json_output["forecast"]) == (None, None)
    assert [finding["kind"] for finding in json_output["findings"]] == ["count-mismatch"]


def test_a_valid_capture_is_described_and_forecast(capture):
    json_output = read_json(run("doctor", capture, "--quick", "--preset", "demo", "--json").stdout)

    assert [camera["name"] for camera in json_output["capture"]["cameras"]] == [
        shot.name for shot in scenes.make_shots()
    ]
    assert json_output["capture"]["frames"] == 3
    forecast = json_output["forecast"]
    assert forecast["seconds"] == pytest.approx(
        forecast["seconds_of_first"] + 2 * forecast["seconds_per_frame"]
    )
    assert 0 < forecast["stream_bytes"][0] < forecast["stream_bytes"][1]


@pytest.mark.parametrize("preset", ["main", "demo"])
def test_the_preset_of_the_forecast_is_named(capture, preset):
    options = ["--preset", preset] if preset != "main" else []

    assert f"encoding time ({preset})" in run("doctor", capture, "--quick", *options).stdout
    json_output = read_json(run("doctor", capture, "--quick", *options, "--json").stdout)
    assert json_output["forecast"]["preset"] == preset


def test_an_unknown_held_out_camera_is_a_usage_error(capture):
    result = run("doctor", capture, "--held-out", "cam99")

    assert result.exit_code == 2
    assert "--held-out: cannot hold out camera cam99" in result.stderr


def test_more_frames_than_the_capture_has_are_a_usage_error(capture):
    result = run("doctor", capture, "--frames", 3, "--start", 1)

    assert result.exit_code == 2
    assert "--frames 3: 3 frames are requested, but capture plane has 2" in result.stderr


@pytest.mark.parametrize(
    ("notes", "has_masks", "used_pixels"),
    [({}, False, "all"), ({}, True, "unmasked"), ({"background": "transparent"}, True, "subject")],
)
def test_used_pixels_are_described(notes, has_masks, used_pixels, capture, tmp_path):
    folder = shutil.copytree(capture, tmp_path / "plane")
    (folder / "quarc-capture.json").write_text(json.dumps(notes))
    mask = np.zeros((32, 48, 3), np.uint8)
    mask[4:28, 4:44] = 255
    for shot in scenes.make_shots() if has_masks else ():
        scenes.write_picture(folder / "masks" / f"{shot.name}.png", mask)

    json_output = read_json(run("doctor", folder, "--quick", "--json").stdout)
    assert json_output["capture"]["used_pixels"] == used_pixels
    assert _PIXEL_DESCRIPTIONS[used_pixels] in run("doctor", folder, "--quick").stdout


def test_the_world_is_described(capture, tmp_path):
    folder = shutil.copytree(capture, tmp_path / "plane")
    assert "up: unknown; meters per unit: unknown" in run("doctor", folder, "--quick").stdout
    (folder / "quarc-capture.json").write_text('{"up": [0, -3, 0], "meters_per_unit": 2}')

    opened = read_json(run("doctor", folder, "--quick", "--json").stdout)["capture"]
    assert (opened["up"], opened["meters_per_unit"]) == ([0, -1, 0], 2)
    assert "up: 0, -1, 0; meters per unit: 2" in run("doctor", folder, "--quick").stdout


def test_masks_have_their_own_findings(capture, tmp_path):
    folder = shutil.copytree(capture, tmp_path / "plane")
    (folder / "masks").mkdir()
    for name, size, kind in (("left", (64, 48), "mask-name"), ("cam01", (8, 8), "mask-size")):
        mask = np.full((*size[::-1], 3), 255, np.uint8)
        scenes.write_picture(folder / "masks" / f"{name}.png", mask)
        json_output = read_json(run("doctor", folder, "--quick", "--json").stdout)
        assert [finding["kind"] for finding in json_output["findings"]] == [kind]


def test_a_missing_device_is_a_usage_error_before_any_check(capture):
    result = run("doctor", capture, "--device", "cuda")

    assert result.exit_code == 2
    assert "torch finds no CUDA device" in result.stderr


@pytest.mark.parametrize(
    ("count", "text"), [(999, "999 B"), (999.6, "0.976 KB"), (999.7 * 2**20, "0.976 GB")]
)
def test_a_size_has_no_exponent(count, text):
    assert _format_bytes(count) == text
