"""`edit`: its results, its report of how it edited, and its errors."""

import pytest

from quarc_ref.streams import decode
from tests.cli.commands import list_names, run, run_json


def test_colors_are_changed_exactly(stream_file, tmp_path):
    out = tmp_path / "out.quarc"
    printed_output = run_json("edit", stream_file, "-o", out, "--recolor", "gain=1.5")

    assert printed_output["method"] == "exact"
    assert printed_output["bounds"] is printed_output["errors"] is None
    assert (printed_output["frames"], printed_output["bytes"]) == (4, out.stat().st_size)


def test_other_edits_are_fitted_again_within_bounds(stream_file, made, tmp_path):
    out = tmp_path / "out.quarc"
    printed_output = run_json("edit", stream_file, "-o", out, "--crop", "-0.2,-1,-1,1,1,1")

    assert printed_output["method"] == "fitted"
    for name, error in printed_output["errors"].items():
        assert error <= printed_output["bounds"][name] * 1.001
    counts = [scene.count for scene in decode(out.read_bytes())]
    assert all(0 < few < state.scene.count for few, state in zip(counts, made.states, strict=True))


def test_the_table_says_which_kind_of_edit_it_was(stream_file, tmp_path):
    exact = run("edit", stream_file, "-o", tmp_path / "a.quarc", "--recolor", "red=0.1")
    fitted = run("edit", stream_file, "-o", tmp_path / "b.quarc", "--drop", "0,0,0,0.05")

    assert "exact, in integers" in exact.stdout
    assert "fitted again" in fitted.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "no edit is given"),
        (["--crop", "1,2,3"], "6 numbers"),
        (["--crop", "1,0,0,0,1,1"], "smaller"),
        (["--drop", "a,b,c,d"], "4 numbers"),
        (["--transform", "1,0,0,0"], "12 or 16"),
        (["--transform", "1,0,0,0,0,1,0,0,0,0,-1,0"], "rotation"),
        (["--recolor", "gain=0"], "above 0"),
        (["--recolor", "hue=1"], "NAME is one of gain"),
        (["--recolor", "red=nan"], "1 numbers"),
    ],
)
def test_contradicting_options_are_a_usage_error(options, message, stream_file, tmp_path):
    result = run("edit", stream_file, "-o", tmp_path / "out.quarc", *options)

    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert list_names(tmp_path) == ["small.quarc"]


def test_an_edit_that_removes_everything_writes_nothing(stream_file, tmp_path):
    result = run("edit", stream_file, "-o", tmp_path / "out.quarc", "--drop", "0,0,0,100")

    assert result.exit_code == 3
    assert "removes all Gaussians" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]
