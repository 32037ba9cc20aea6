"""Tests of `edit`: edited streams, printed methods, and errors."""

import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.encoder.scenes.bounds import PROFILES
from quarc_ref.streams import decode
from tests.cli.commands import list_names, run, run_json


def test_colors_are_changed_without_fitting_frames_again(stream_file, tmp_path):
    edited_file = tmp_path / "out.quarc"
    json_output = run_json("edit", stream_file, "-o", edited_file, "--recolor", "gain=1.5")

    assert json_output["method"] == "exact"
    assert json_output["bounds"] is json_output["errors"] is None
    assert (json_output["frames"], json_output["bytes"]) == (4, edited_file.stat().st_size)


def test_other_edits_are_fitted_again_within_bounds(stream_file, small_stream, tmp_path):
    edited_file = tmp_path / "out.quarc"
    json_output = run_json("edit", stream_file, "-o", edited_file, "--crop", "-0.2,-1,-1,1,1,1")

    assert json_output["method"] == "fitted"
    for name, error in json_output["errors"].items():
        assert error <= json_output["bounds"][name] * 1.001
    counts = [scene.count for scene in decode(edited_file.read_bytes())]
    assert all(
        0 < count < state.scene.count
        for count, state in zip(counts, small_stream.states, strict=True)
    )


def test_the_matrix_of_a_transform_is_given_row_by_row(stream_file, small_stream, tmp_path):
    matrix = "0,-2,0,0.5,2,0,0,0,0,0,2,-1"  # a quarter turn about z, twice the size, and a shift
    options = ["--transform", matrix, "--profile", "coarse"]
    json_output = run_json("edit", stream_file, "-o", tmp_path / "out.quarc", *options)

    assert json_output["bounds"]["sh_dc"] == PROFILES["coarse"].sh_dc != PROFILES["fine"].sh_dc
    edited_scenes = decode((tmp_path / "out.quarc").read_bytes())
    for scene, state in zip(edited_scenes, small_stream.states, strict=True):
        x, y, z = dequantize(state.scene).positions.mean(axis=0)
        assert dequantize(scene).positions.mean(axis=0) == pytest.approx(
            (0.5 - 2 * y, 2 * x, 2 * z - 1), abs=json_output["bounds"]["position"]
        )


@pytest.mark.parametrize("corners", ["1,1,1,-0.2,-1,-1", "1,-1,1,-0.2,1,-1"])
def test_a_box_has_any_two_opposite_corners(corners, stream_file, tmp_path):
    edited = [tmp_path / "a.quarc", tmp_path / "b.quarc"]
    for file, crop in zip(edited, ["-0.2,-1,-1,1,1,1", corners], strict=True):
        assert run("edit", stream_file, "-o", file, "--crop", crop).exit_code == 0

    assert edited[0].read_bytes() == edited[1].read_bytes()


def test_the_table_says_which_kind_of_edit_it_was(stream_file, tmp_path):
    color_edit = run("edit", stream_file, "-o", tmp_path / "a.quarc", "--recolor", "red=0.1")
    fitted_edit = run("edit", stream_file, "-o", tmp_path / "b.quarc", "--drop", "0,0,0,0.05")

    assert "only colors; offsets are rounded to whole codes" in color_edit.stdout
    assert "fitted again" in fitted_edit.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "no edit is given"),
        (["--crop", "1,2,3"], "6 numbers"),
        (["--drop", "a,b,c,d"], "4 numbers"),
        (["--drop", "0,0,0,-0.5"], "a radius of at least 0"),
        (["--transform", "1,0,0,0"], "12 or 16"),
        (["--transform", "1,0,0,0,0,1,0,0,0,0,-1,0"], "rotation"),
        (["--recolor", "gain=0"], "above 0"),
        (["--recolor", "hue=1"], "NAME is one of gain"),
        (["--recolor", "red=nan"], "1 number, not"),
        (["--recolor", "red=0.1", "--recolor", "red=0.2"], "red is given twice"),
    ],
)
def test_contradicting_options_are_a_usage_error(options, message, stream_file, tmp_path):
    result = run("edit", stream_file, "-o", tmp_path / "out.quarc", *options)

    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert list_names(tmp_path) == ["small.quarc"]


@pytest.mark.parametrize("radius", ["100", "1e308"])
def test_an_edit_that_removes_everything_writes_nothing(radius, stream_file, tmp_path):
    result = run("edit", stream_file, "-o", tmp_path / "out.quarc", "--drop", f"0,0,0,{radius}")

    assert result.exit_code == 2
    assert "frame 0: the edit removes all Gaussians" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]
