import re
import shutil

import pytest
import torch

from quarc_ref.evaluation import lpips as module
from tests.cli.commands import list_names, run, run_json


@pytest.fixture(scope="module")
def plys(encoded, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plys") / "theirs"
    assert run("decode", encoded.file, "-o", folder, "--to", "ply").exit_code == 0
    return folder


@pytest.fixture(scope="module")
def measured(encoded, plys, capture, tmp_path_factory):
    """The output of `compare --json --report`, and the report's folder."""
    folder = tmp_path_factory.mktemp("compare") / "report"
    entries = [f"ours@a={encoded.file}", f"ours@a={encoded.file}", f"theirs={plys}"]
    return run_json("compare", *entries, "--capture", capture, "--report", folder), folder


def test_compare_shows_the_figures_of_eval_side_by_side(measured, encoded, capture):
    printed, _ = measured
    ours, theirs = printed["points"]
    evaluated = run_json("eval", encoded.file, capture)

    assert (ours["method"], ours["point"], ours["runs"]) == ("ours", "a", 2)
    assert (theirs["method"], theirs["point"], theirs["kind"]) == (
        "theirs",
        "theirs",
        "PLY per frame",
    )
    assert ours["quality"] == pytest.approx(evaluated["quality"]["mean"])
    assert ours["deviation"]["psnr"] == 0
    assert ours["bytes"] == evaluated["bytes"]["total"]
    assert theirs["quality"]["psnr"] == pytest.approx(ours["quality"]["psnr"], abs=1e-4)
    assert theirs["paired"]["pairs"] == len(printed["frames"]) * len(printed["cameras"]) == 3
    assert printed["bd"] == []


def test_the_report_has_a_page_with_pictures_and_tables(measured):
    printed, folder = measured
    page = (folder / "index.html").read_text("utf-8")
    named = set(re.findall(r"view\d_\d\.png", page))

    assert printed["report"] == str(folder / "index.html")
    assert named == {name for name in list_names(folder) if name.endswith(".png")}
    assert len(named) == 3 * 4  # views of the truth and three entries
    assert {"points.csv", "views.csv"} < set(list_names(folder))
    assert "ours@a, run 2" in page
    assert "psnr: floats" in page
    assert "psnr: psnr" not in page


def test_a_table_is_printed_without_json(encoded, plys, capture):
    result = run("compare", encoded.file, plys, "--capture", capture, "--frames", "1:")

    assert result.exit_code == 0, result.stderr
    assert re.search(r"^plane +stream +1 +\d+\.\d\d", result.stdout, re.MULTILINE)
    assert re.search(r"^theirs +PLY per frame .* of 2$", result.stdout, re.MULTILINE)


def test_without_labels_two_files_of_the_same_name_are_distinguished(encoded, tmp_path):
    (tmp_path / "other").mkdir()
    other = shutil.copy(encoded.file, tmp_path / "other")
    printed = run_json("compare", encoded.file, encoded.file, other)

    assert printed["points"][-1]["method"] == str(other)


def test_equal_pictures_count_as_100_db_and_are_reported(encoded):
    result = run("compare", encoded.file, f"same={encoded.file}", "--frames", "1")

    assert "same: 1 of 1 views equal the truth; each counts as 100 dB" in result.stderr
    assert re.search(r"^same +stream +1 +100\.00 ", result.stdout, re.MULTILINE)
    assert ": 1 frame " in result.stdout


def test_renders_have_the_given_size_in_bytes(encoded, capture, tmp_path):
    run("render", encoded.file, "--to", "png", "-o", tmp_path / "drawn")
    printed = run_json(
        "compare", encoded.file, tmp_path / "drawn", "--capture", capture,
        "--bytes", f"{tmp_path / 'drawn'}=3072",
    )  # fmt: skip

    assert printed["points"][1]["kind"] == "renders"
    assert printed["points"][1]["kb_per_frame"] == 1


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """Weights of LPIPS with their real names, for a much smaller network."""
    state = {f"scaling_layer.{name}": torch.ones(1, 3, 1, 1) for name in ("shift", "scale")}
    for place, layers in enumerate(module._SLICES):
        for layer in layers:
            entering = 3 if layer == 0 else 2
            state[f"net.slice{place + 1}.{layer}.weight"] = torch.ones(2, entering, 3, 3) / 18
            state[f"net.slice{place + 1}.{layer}.bias"] = torch.tensor([0.1, 2.0])
        state[f"lin{place}.model.1.weight"] = torch.ones(1, 2, 1, 1)
    path = tmp_path_factory.mktemp("weights") / "lpips.pth"
    torch.save(state, path)
    return path


def test_lpips_is_measured_if_weights_are_given(encoded, plys, capture, weights):
    compared = run_json("compare", encoded.file, plys, "--capture", capture, "--lpips", weights)
    evaluated = run_json("eval", encoded.file, capture, "--lpips", weights)

    assert compared["points"][0]["quality"]["lpips"] == evaluated["quality"]["mean"]["lpips"] > 0
    for printed in (compared, evaluated):
        assert "VGG16" in printed["metrics"]["lpips"]
    assert evaluated["protocol"]["metrics"] == evaluated["metrics"]


def test_eval_measures_the_requested_frames(encoded, capture, tmp_path):
    whole = run_json("eval", encoded.file, capture)
    part = run_json(
        "eval", encoded.file, capture, "--frames", "1:3", "--report", tmp_path / "report"
    )

    assert part["psnr_per_frame"] == whole["psnr_per_frame"][1:3]
    assert part["protocol"]["frames"] == 2
    assert run("eval", encoded.file, capture, "--frames", "3:").exit_code == 2


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{stream}", "at least two entries"),
        ("{stream} {out}", "does not exist"),
        ("{stream} {stream} --bytes x=3", "--bytes names x"),
        ("{stream} {stream} --bytes 3", "--bytes takes PATH=N"),
        ("{stream} {stream} --lpips {stream}", "is not a readable file of LPIPS weights"),
        ("{stream} {stream} --camera cam77", "no camera cam77"),
        ("{stream} {stream} --frames 77", "the entries have no frame in common"),
        ("{stream} {empty}", "has no pictures of cam00"),
    ],
)
def test_entries_that_cannot_be_compared_are_a_usage_error(line, message, encoded, tmp_path):
    (tmp_path / "empty").mkdir()
    places = {"stream": encoded.file, "out": tmp_path / "out", "empty": tmp_path / "empty"}
    result = run("compare", *line.format(**places).split(), "--report", tmp_path / "report")

    assert result.exit_code == 2
    assert message in " ".join(result.stderr.replace("│", " ").split())
    assert list_names(tmp_path) == ["empty"]


def test_a_stream_of_another_capture_is_compared_only_on_request(encoded, capture, tmp_path):
    other = shutil.copytree(capture, tmp_path / "plane")
    shutil.copy(other / "cam01.mp4", other / "cam00.mp4")
    line = ["compare", encoded.file, encoded.file, "--capture", other]

    refused, taken = run(*line), run(*line, "--other-capture")
    assert (refused.exit_code, taken.exit_code) == (2, 0)
    assert "made from another capture" in refused.stderr
