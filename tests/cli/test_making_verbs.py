"""Tests of the verbs that make captures: `synth` and `demo`."""

from typing import get_args

import pytest
import typer

from quarc_ref.cli.app import app
from quarc_ref.cli.verbs.capture import VariantName
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.synth.variants import VARIANTS
from tests.cli.commands import list_names, run, run_json


def test_synth_makes_a_capture_of_the_requested_size(tmp_path):
    size = ["--width", 32, "--height", 24, "--frames", 2, "--seed", 4]
    json_output = run_json("synth", tmp_path / "room", *size)

    assert json_output == {
        "folder": str(tmp_path / "room"),
        "variant": "playroom",
        "width": 32,
        "height": 24,
        "frames": 2,
        "cameras": 13,
    }
    capture = open_capture(tmp_path / "room")
    assert capture.frame_count == 2
    assert capture.image(12, 1).shape == (24, 32, 3)


def test_synth_prints_what_it_has_written(tmp_path):
    result = run("synth", tmp_path / "room", "--width", 16, "--height", 16, "--frames", 1)

    assert result.exit_code == 0
    assert "13 with 1 frame each, 16 x 16; cam00 should be held out" in result.stdout


def test_every_variant_is_available_and_explained():
    options = typer.main.get_command(app).commands["synth"].params
    (help_text,) = (option.help for option in options if option.name == "variant")

    assert get_args(VariantName) == tuple(VARIANTS)
    for name, variant in VARIANTS.items():
        assert f"{name}: {variant.summary}" in help_text


def test_synth_traces_the_requested_variant_and_cameras(tmp_path):
    size = ["--width", 16, "--height", 16, "--frames", 1, "--cameras", 3]
    json_output = run_json("synth", tmp_path / "dark", *size, "--variant", "dark-stage")
    run_json("synth", tmp_path / "bright", *size, "--variant", "bright-stage")

    assert (json_output["variant"], json_output["cameras"]) == ("dark-stage", 3)
    pictures = [open_capture(tmp_path / name).image(0, 0) for name in ("dark", "bright")]
    assert pictures[0].mean() < 0.5 * pictures[1].mean()
    assert len(open_capture(tmp_path / "dark").cameras) == 3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--width", 33], "width is 33"),
        (["--height", 17], "height is 17"),
        (["--width", 1000000, "--height", 1000000], "the limits are 16,384 pixels per side"),
        (["--width", 16384, "--height", 16384], "134,217,728 pixels in total"),
        (["--width", 8], "--width"),
        (["--frames", 0], "--frames"),
        (["--cameras", 2], "--cameras"),
        (["--cameras", 101], "--cameras"),
        (["--variant", "night"], "'dark-stage'"),
        (["--seed", -1], "--seed"),
        (["--masks"], "bright-stage, dark-stage have them"),
    ],
)
def test_impossible_sizes_are_a_usage_error(options, message, tmp_path):
    result = run("synth", tmp_path / "room", *options)

    assert result.exit_code == 2
    assert message in result.stderr
    assert list_names(tmp_path) == []


def test_synth_rejects_a_nonempty_folder(tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    rejected_run, forced_run = run("synth", tmp_path), run("synth", tmp_path, "--force")

    assert (rejected_run.exit_code, forced_run.exit_code) == (2, 2)
    assert "mine.txt, which quarc-ref did not create" in rejected_run.stderr
    assert rejected_run.stderr == forced_run.stderr
    assert list_names(tmp_path) == ["mine.txt"]


def test_a_traced_capture_is_replaced_only_with_force(tmp_path):
    size = ["--width", 16, "--height", 16, "--frames", 1]
    (tmp_path / "room").mkdir()
    run_json("synth", tmp_path / "room", *size)
    rejected_run = run("synth", tmp_path / "room", *size, "--seed", 1)
    video_before = (tmp_path / "room" / "cam00.mp4").read_bytes()
    run_json("synth", tmp_path / "room", *size, "--seed", 1, "--force")

    assert rejected_run.exit_code == 2
    assert (tmp_path / "room" / "cam00.mp4").read_bytes() != video_before
    assert list_names(tmp_path) == ["room"]


def test_force_does_not_replace_a_filmed_capture(tmp_path):
    for name in ("cam00.mp4", "cam13.mp4", "poses_bounds.npy"):
        (tmp_path / name).write_text("filmed")
    result = run("synth", tmp_path, "--force")

    assert result.exit_code == 2
    assert "cam00.mp4, which quarc-ref did not create" in result.stderr
    assert len(list_names(tmp_path)) == 3


def test_the_demo_writes_capture_stream_and_report(tiny_demo):
    folder, json_output = tiny_demo.folder, tiny_demo.json_output

    assert list_names(folder) == ["capture", "demo.html", "demo.quarc", "report"]
    assert list_names(folder.parent) == ["out"]
    assert json_output["file"] == str(folder / "demo.quarc")
    assert json_output["report"] == str(folder / "report" / "index.html")
    assert (folder / "report" / "index.html").is_file()
    assert json_output["player"] == str(folder / "demo.html")
    assert b'src="data:application/octet-stream;base64,' in (folder / "demo.html").read_bytes()


def test_the_demo_prints_the_same_as_eval_of_its_files(tiny_demo):
    folder, json_output = tiny_demo.folder, tiny_demo.json_output

    eval_output = run_json("eval", folder / "demo.quarc", folder / "capture")
    assert json_output.keys() == eval_output.keys() | {"player", "report"}
    assert {key: json_output[key] for key in eval_output} == eval_output


def test_a_demo_is_replaced_only_with_force(tiny_demo, monkeypatch):
    def fail(*_arguments, **_keywords):
        pytest.fail("the demo was run")

    folder = tiny_demo.folder
    monkeypatch.setattr("quarc_ref.cli.demo_work.run_demo", fail)
    rejected_run = run("demo", "-o", folder)

    assert rejected_run.exit_code == 2
    assert "--force" in rejected_run.stderr
    assert list_names(folder) == ["capture", "demo.html", "demo.quarc", "report"]


def test_a_failed_demo_keeps_the_old_one(tiny_demo, monkeypatch):
    def fail(folder, *_arguments):
        folder.write("half", b"half")
        raise KeyboardInterrupt

    folder = tiny_demo.folder
    data_before = (folder / "demo.quarc").read_bytes()
    monkeypatch.setattr("quarc_ref.cli.demo_work.run_demo", fail)
    results = [run("demo", "-o", folder, "--force"), run("demo", "-o", folder.parent / "new")]

    assert [result.exit_code for result in results] == [130, 130]
    assert list_names(folder.parent) == ["out"]
    assert (folder / "demo.quarc").read_bytes() == data_before
