import re
import shutil

import pytest
import torch

from quarc_ref.cli.verbs.compare import parse_entries
from quarc_ref.evaluation import lpips as lpips_module
from tests.cli.commands import list_names, run, run_json


@pytest.fixture(scope="module")
def ply_folder(encoded_stream, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plys") / "theirs"
    assert run("decode", encoded_stream.file, "-o", folder, "--to", "ply").exit_code == 0
    return folder


@pytest.fixture(scope="module")
def output_and_report(encoded_stream, ply_folder, capture, tmp_path_factory):
    """The JSON output of `compare --report`, and the folder of the report."""
    folder = tmp_path_factory.mktemp("compare") / "report"
    entries = [
        f"ours@a={encoded_stream.file}",
        f"ours@a={encoded_stream.file}",
        f"theirs={ply_folder}",
    ]
    return run_json("compare", *entries, "--capture", capture, "--report", folder), folder


def test_compare_shows_the_figures_of_eval_side_by_side(output_and_report, encoded_stream, capture):
    json_output, _ = output_and_report
    own_point, other_point = json_output["points"]
    evaluation = run_json("eval", encoded_stream.file, capture)

    assert (own_point["method"], own_point["point"], own_point["runs"]) == ("ours", "a", 2)
    assert (other_point["method"], other_point["point"], other_point["kind"]) == (
        "theirs",
        "theirs",
        "PLY per frame",
    )
    assert own_point["quality"] == pytest.approx(evaluation["quality"]["mean"])
    assert own_point["deviation"]["psnr"] == 0
    assert own_point["bytes"] == evaluation["bytes"]["total"]
    assert other_point["quality"]["psnr"] == pytest.approx(own_point["quality"]["psnr"], abs=1e-4)
    assert (
        other_point["paired"]["pairs"]
        == len(json_output["frames"]) * len(json_output["cameras"])
        == 3
    )
    assert json_output["bd"] == []
    for name, value in json_output["protocol"].items():
        assert value == evaluation["protocol"][name]


def test_the_report_has_a_page_with_pictures_and_tables(output_and_report):
    json_output, folder = output_and_report
    page = (folder / "index.html").read_text("utf-8")
    listed_names = set(re.findall(r"view\d_\d\.png", page))

    assert json_output["report"] == str(folder / "index.html")
    assert listed_names == {name for name in list_names(folder) if name.endswith(".png")}
    assert len(listed_names) == 3 * 4  # views of the truth and three entries
    assert {"points.csv", "views.csv"} < set(list_names(folder))
    assert "ours@a, run 2" in page
    assert "psnr: floats" in page
    assert "psnr: psnr" not in page
    for value in (json_output["protocol"]["fingerprint"], "48 x 32", "numba on the CPU"):
        assert value in page


def test_a_table_is_printed_without_json(encoded_stream, ply_folder, capture):
    result = run("compare", encoded_stream.file, ply_folder, "--capture", capture, "--frames", "1:")

    assert result.exit_code == 0, result.stderr
    assert re.search(r"^plane +stream +1 +\d+\.\d\d", result.stdout, re.MULTILINE)
    assert re.search(r"^theirs +PLY per frame .* of 2$", result.stdout, re.MULTILINE)


def test_without_labels_two_files_of_the_same_name_are_distinguished(encoded_stream, tmp_path):
    (tmp_path / "other").mkdir()
    other_file = shutil.copy(encoded_stream.file, tmp_path / "other")
    json_output = run_json("compare", encoded_stream.file, encoded_stream.file, other_file)

    assert json_output["points"][-1]["method"] == str(other_file)


def test_equal_pictures_count_as_100_db_and_are_reported(encoded_stream):
    result = run("compare", encoded_stream.file, f"same={encoded_stream.file}", "--frames", "1")

    assert "same equals the truth in 1 of 1 views; each of them counts as 100 dB" in result.stderr
    assert re.search(r"^same +stream +1 +100\.00 ", result.stdout, re.MULTILINE)
    assert ": 1 frame " in result.stdout


def test_entries_have_the_stated_size_in_bytes(encoded_stream, ply_folder, capture, tmp_path):
    drawn = tmp_path / "drawn"
    run("render", encoded_stream.file, "--to", "png", "-o", drawn)
    json_output = run_json(
        "compare", encoded_stream.file, drawn, f"plys@a={ply_folder}", f"plys@b={ply_folder}",
        "--capture", capture, "--bytes", f"{drawn}=3072", "--bytes", "plys@a=2048",
    )  # fmt: skip
    stream, renders, *plys = json_output["points"]

    assert (renders["kind"], renders["kb_per_frame"], renders["bytes_stated"]) == (
        "renders",
        1,
        True,
    )
    assert [point["kind"] for point in plys] == ["PLY per frame"] * 2
    assert (plys[0]["bytes"], plys[0]["bytes_stated"]) == (2048, True)
    assert plys[1]["bytes"] > 2048
    assert not plys[1]["bytes_stated"]
    assert not stream["bytes_stated"]


def test_stated_sizes_are_marked(encoded_stream, ply_folder, capture, tmp_path):
    entries = [encoded_stream.file, ply_folder, "--capture", capture, "--bytes", "theirs=3072"]
    result = run("compare", *entries, "--report", tmp_path / "report")
    points = (tmp_path / "report" / "points.csv").read_text("utf-8").splitlines()
    stated_column = points[0].split(",").index("bytes_stated")

    assert re.search(r"^theirs +PLY per frame .* 3,072 stated ", result.stdout, re.MULTILINE)
    assert "3,072 stated" in (tmp_path / "report" / "index.html").read_text("utf-8")
    assert [line.split(",")[stated_column] for line in points[1:]] == ["False", "True"]


def test_a_given_size_holds_for_every_entry_with_this_path(encoded_stream, capture, tmp_path):
    folder = tmp_path / "drawn"
    run("render", encoded_stream.file, "--to", "png", "-o", folder)
    entries = [f"a={folder}", f"b={folder}"]
    json_output = run_json("compare", *entries, "--capture", capture, "--bytes", f"{folder}=3072")

    assert [point["kb_per_frame"] for point in json_output["points"]] == [1, 1]


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A file of LPIPS weights with the real names and much smaller tensors."""
    state = {f"scaling_layer.{name}": torch.ones(1, 3, 1, 1) for name in ("shift", "scale")}
    for slice_index, layers in enumerate(lpips_module._CONVOLUTIONS_BY_SLICE):
        for layer in layers:
            input_channels = 3 if layer == 0 else 2
            state[f"net.slice{slice_index + 1}.{layer}.weight"] = (
                torch.ones(2, input_channels, 3, 3) / 18
            )
            state[f"net.slice{slice_index + 1}.{layer}.bias"] = torch.tensor([0.1, 2.0])
        state[f"lin{slice_index}.model.1.weight"] = torch.ones(1, 2, 1, 1)
    path = tmp_path_factory.mktemp("weights") / "lpips.pth"
    torch.save(state, path)
    return path


def test_lpips_is_measured_if_weights_are_given(encoded_stream, ply_folder, capture, weights):
    comparison = run_json(
        "compare", encoded_stream.file, ply_folder, "--capture", capture, "--lpips", weights
    )
    evaluation = run_json("eval", encoded_stream.file, capture, "--lpips", weights)

    assert comparison["points"][0]["quality"]["lpips"] == evaluation["quality"]["mean"]["lpips"] > 0
    for json_output in (comparison, evaluation):
        assert "VGG16" in json_output["metrics"]["lpips"]
    assert evaluation["protocol"]["metrics"] == evaluation["metrics"]


def test_eval_measures_the_requested_frames(encoded_stream, capture, tmp_path):
    all_frames = run_json("eval", encoded_stream.file, capture)
    requested_frames = run_json(
        "eval", encoded_stream.file, capture, "--frames", "1:3", "--report", tmp_path / "report"
    )

    assert requested_frames["psnr_per_frame"] == all_frames["psnr_per_frame"][1:3]
    protocol = requested_frames["protocol"]
    assert (protocol["first_frame"], protocol["frames"]) == (1, 2)
    assert run("eval", encoded_stream.file, capture, "--frames", "3:").exit_code == 2


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{stream}", "at least two entries"),
        ("{stream} {out}", "does not exist"),
        ("{stream} https://example.org/a.quarc", "only files, not URLs or standard input"),
        ("{stream} a=https://example.org/?a=b", "only files, not URLs or standard input"),
        ("{stream} -", "only files, not URLs or standard input"),
        ("{stream} {stream} --bytes x=3", "--bytes names x"),
        ("{stream} {stream} --bytes 3", "--bytes takes ENTRY=N"),
        (f"{{stream}} {{stream}} --bytes x={'9' * 5000}", "--bytes takes ENTRY=N"),
        ("{stream} {stream} --bytes {stream}=3", "--bytes is not for streams"),
        ("{stream} {stream} --lpips {stream}", "quarc is not a file that torch.save has written"),
        ("{stream} {stream} --camera cam77", "no camera cam77"),
        ("{stream} {stream} --downscale 2", "--downscale is not for streams"),
        ("{stream} {stream} --frames 77", "the selected range has none of the frames"),
        ("{stream} {empty}", "neither .ply files nor pictures of cam00"),
    ],
)
def test_entries_that_cannot_be_compared_are_a_usage_error(line, message, encoded_stream, tmp_path):
    (tmp_path / "empty").mkdir()
    paths = {"stream": encoded_stream.file, "out": tmp_path / "out", "empty": tmp_path / "empty"}
    result = run("compare", *line.format(**paths).split(), "--report", tmp_path / "report")

    assert result.exit_code == 2
    assert message in " ".join(result.stderr.replace("│", " ").split())
    assert list_names(tmp_path) == ["empty"]


def test_pictures_that_cannot_be_downscaled_are_a_usage_error(ply_folder, capture):
    entries = (f"a={ply_folder}", f"b={ply_folder}")
    result = run("compare", *entries, "--capture", capture, "--downscale", 1000)

    assert result.exit_code == 2
    assert "cannot be downscaled by 1000" in result.stderr


def test_a_stream_of_another_capture_is_compared_only_on_request(encoded_stream, capture, tmp_path):
    other_capture = shutil.copytree(capture, tmp_path / "plane")
    shutil.copy(other_capture / "cam01.mp4", other_capture / "cam00.mp4")
    line = ["compare", encoded_stream.file, encoded_stream.file, "--capture", other_capture]

    rejected_run, accepted_run = run(*line), run(*line, "--other-capture")
    assert (rejected_run.exit_code, accepted_run.exit_code) == (2, 0)
    assert f"{encoded_stream.file}: the stream was made from another" in rejected_run.stderr
    assert "use --other-capture" in rejected_run.stderr
    warning = f"{encoded_stream.file}: the stream was made from another capture"
    assert accepted_run.stderr.count(warning) == 2


def test_a_stream_without_a_fingerprint_is_compared_with_a_warning(
    encoded_stream, capture, tmp_path
):
    cut_file, joined_file = tmp_path / "cut.quarc", tmp_path / "joined.quarc"
    assert run("cut", encoded_stream.file, "--frames", "0:1", "-o", cut_file).exit_code == 0
    assert run("join", cut_file, cut_file, "-o", joined_file).exit_code == 0
    line = ["compare", encoded_stream.file, joined_file, "--capture", capture, "--frames", "0:1"]
    result = run(*line, "--report", tmp_path / "report")

    warning = f"{joined_file}: the stream has no fingerprint of its capture"
    assert warning in result.stderr
    assert warning in (tmp_path / "report" / "index.html").read_text("utf-8")
    assert f"{encoded_stream.file}:" not in result.stderr


def test_a_stream_that_was_trained_on_a_compared_camera_is_named(
    encoded_stream, ply_folder, capture
):
    cameras = run_json("eval", encoded_stream.file, capture)["protocol"]["cameras"]
    line = ["compare", encoded_stream.file, ply_folder, "--capture", capture, "--frames", "0:1"]
    held_out, *training = cameras["held_out"][:1] + cameras["training"][:2]
    favored_run = run(*line, *(f"--camera={name}" for name in (held_out, *training)))
    fair_run = run(*line, "--camera", held_out)

    warning = f"{', '.join(training)} are not held out of the stream, which favors it"
    assert f"{encoded_stream.file}: {warning}" in favored_run.stderr
    assert (favored_run.exit_code, fair_run.exit_code) == (0, 0)
    assert "held out" not in fair_run.stderr


def test_a_damaged_stream_is_named(encoded_stream, tmp_path):
    damaged_file = tmp_path / "damaged.quarc"
    damaged_file.write_bytes(encoded_stream.file.read_bytes()[:-1])
    result = run("compare", encoded_stream.file, damaged_file)

    assert result.exit_code == 1
    assert f": {damaged_file}: the stream ends inside a chunk" in result.stderr


@pytest.mark.parametrize(
    ("texts", "labels"),
    [
        (["ours=low/x.quarc", "ours=high/x.quarc"], ["ours@low/x.quarc", "ours@high/x.quarc"]),
        (["low@1/x.quarc", "high@1/x.quarc"], ["low@1/x.quarc", "high@1/x.quarc"]),
        (["ours@q=low/x.quarc", "ours@q=high/x.quarc"], ["ours@q", "ours@q"]),
        (["ours=q1.quarc", "ours=q2.quarc"], ["ours@q1", "ours@q2"]),
    ],
)
def test_only_entries_with_the_same_given_label_are_runs(texts, labels):
    sources = parse_entries(texts, [])

    assert [str(source.label) for source in sources] == labels
    assert len({source.label for source in sources}) == len(set(labels))
