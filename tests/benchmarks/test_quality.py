"""The whole protocol on a tiny traced capture, with minimal training."""

import csv
import io
import json
import shutil

import numpy as np
import pytest

import studies
from quality import command
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.inspection.inspect_stream import inspect_stream
from tests.cli.commands import TINY

SETTINGS = [part for key, value in TINY.items() for part in ("--set", f"{key}={value}")]
NAME = "fast-3-32x24"
WORDS = ["--variants", NAME, "--frames", "2", "--seeds", "2", "--preset", "demo", *SETTINGS]


@pytest.fixture
def here(monkeypatch):
    """Run jobs in this process; return the list of the names of completed jobs."""
    ran = []

    def run(function, jobs, _where, tell):
        for job in jobs:
            function(job.argument)
            ran.append(job.name)
            tell(job.name, len(ran), len(jobs))

    monkeypatch.setattr(studies, "run_jobs", run)
    return ran


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder of a finished study, run in a process for each encode."""
    out = tmp_path_factory.mktemp("quality") / "out"
    assert command.main([*WORDS, "--out", str(out)]) == 0
    return out


@pytest.fixture
def copy(study, tmp_path):
    """The same, to resume."""
    return shutil.copytree(study, tmp_path / "out")


def _read_row(out, seed):
    return json.loads((out / "rows" / f"{NAME}.set0.seed{seed}.json").read_text())


def _read_csv(path):
    return list(csv.DictReader(io.StringIO(path.read_text())))


def test_the_figures_are_those_of_the_kept_stream(study):
    row = _read_row(study, 1)
    data = (study / "streams" / f"{NAME}.set0.seed1.quarc").read_bytes()
    evaluation = evaluate_stream(data, study / "captures" / NAME, lambda *_: None)
    summary, figures = inspect_stream(data), row["figures"]

    for name, value in evaluation.quality.mean().items():
        assert figures[f"held_out_{name}"] == pytest.approx(value)
    kinds = ("side", "canonical", "motion", "births", "other")
    assert sum(figures[f"bytes_{kind}"] for kind in kinds) == figures["bytes"] == len(data)
    assert figures["bytes_canonical"] == summary.frames[0].chunk_bytes
    assert figures["gaussians"] == summary.gaussian_count
    assert figures["seconds_first"] > 0
    assert figures["seconds_frame"] > 0
    assert figures["held_out_lpips"] is None
    assert summary.header.seed == row["seed"] == 1


def test_training_views_are_measured_with_gains_and_the_moving_region_separately(study):
    row = _read_row(study, 0)
    figures = row["figures"]

    assert figures["training_gain_psnr"] > figures["training_psnr"]
    assert figures["training_moving_gain_psnr"] != figures["training_static_gain_psnr"]
    assert figures["held_out_flicker"] is not None
    assert len(row["per_frame"]["training"]) == 2


def test_table_and_json_have_mean_and_deviation_over_seeds(study):
    rows = [_read_row(study, seed)["figures"]["held_out_psnr"] for seed in (0, 1)]
    (group,) = json.loads((study / "quality.json").read_text())["groups"]
    spread = group["figures"]["held_out_psnr"]
    (line,) = _read_csv(study / "quality.csv")

    assert spread["mean"] == pytest.approx(np.mean(rows))
    assert spread["deviation"] == pytest.approx(np.std(rows, ddof=1))
    assert float(line["held_out_psnr_mean"]) == spread["mean"]
    assert line["held_out_lpips_mean"] == ""
    shown = f"| {NAME}/0 | 2 | {spread['mean']:.2f} +- {spread['deviation']:.2f} |"
    assert shown in (study / "quality.md").read_text()
    assert "| LPIPS |" not in (study / "quality.md").read_text()


def test_there_is_a_line_for_each_frame_and_a_plot(study):
    frames = _read_csv(study / "frames.csv")

    assert [line["frame"] for line in frames] == ["0", "1"]
    assert float(frames[1]["training_moving_gain_psnr_mean"]) > 0
    assert (study / "quality.png").read_bytes().startswith(b"\x89PNG")


def test_completed_trials_are_not_run_again(copy, here):
    before = (copy / "quality.md").read_text()

    assert command.main([*WORDS, "--out", str(copy)]) == 0
    assert here == []
    assert (copy / "quality.md").read_text() == before


def test_an_interrupted_study_resumes(copy, here):
    (copy / "rows" / f"{NAME}.set0.seed1.json").unlink()

    assert command.main([*WORDS, "--out", str(copy)]) == 0
    assert here == [f"{NAME}.set0.seed1"]


def test_ctrl_c_leaves_the_table_of_completed_rows(copy, monkeypatch, capsys):
    def interrupt(*_arguments):
        raise KeyboardInterrupt

    (copy / "rows" / f"{NAME}.set0.seed1.json").unlink()
    monkeypatch.setattr(studies, "run_jobs", interrupt)

    assert command.main([*WORDS, "--out", str(copy)]) == 130
    assert "interrupted: the same command continues" in capsys.readouterr().err
    assert f"| {NAME}/0 | 1 |" in (copy / "quality.md").read_text()


def test_rows_with_other_settings_are_computed_again(copy, here):
    words = [*WORDS, "--set", "motion.iterations=4", "--out", str(copy)]

    assert command.main(words) == 0
    assert here == [f"{NAME}.set0.seed{seed}" for seed in (0, 1)]


def test_two_studies_are_compared(study, copy, capsys):
    whole = json.loads((copy / "quality.json").read_text())
    figure = whole["groups"][0]["figures"]["held_out_psnr"]
    figure["mean"] += 0.5
    (copy / "quality.json").write_text(json.dumps(whole))

    assert command.main(["--out", str(copy), "--against", str(study)]) == 0
    table = capsys.readouterr().out
    error = f"{figure['deviation']:.2f}"  # two seeds each: the root of 2 s^2 / 2
    assert f"| {NAME}/0 | +0.50 +- {error} |" in table
    assert f"| mean | +0.50 +- {error} |" in table


def test_a_real_capture_has_four_held_out_sets(study, tmp_path):
    arguments = command._parse_arguments(
        ["--out", str(tmp_path), "--variants", "", "--seeds", "1", "--downscale", "2"]
    )
    arguments.real = arguments.still = study / "captures" / NAME
    with pytest.raises(ValueError, match="3 cameras are too few"):
        command.plan_study(arguments)

    arguments.real = None
    (task,) = command.plan_study(arguments).tasks
    assert (task.name, task.options.held_out) == ("still.set0.seed0", ("cam00",))
    assert open_capture(task.source, task.options).cameras[0].width == 16


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--variants", "night"], "'night' is not a traced capture"),
        (["--variants", ""], "no capture is given"),
        (["--variants", NAME, "--set", "motion.speed=1"], "no setting 'motion.speed'"),
        (["--variants", NAME, "--workers", "0"], "workers and threads must be at least 1"),
        (["--lpips", "none.pth"], "none.pth is not a readable file of LPIPS weights"),
        (["--real", "nowhere"], "nowhere"),
        (["--against", "nowhere"], "quality.json does not exist: run the study first"),
    ],
)
def test_impossible_options_are_rejected_before_anything_runs(
    words, reported, tmp_path, here, capsys
):
    assert command.main([*words, "--out", str(tmp_path)]) == 2
    assert reported in capsys.readouterr().err
    assert here == []
    assert not any(tmp_path.iterdir())


def test_studies_of_other_captures_are_not_compared(copy, study, capsys):
    whole = json.loads((copy / "quality.json").read_text())
    whole["groups"][0]["capture"] = "another"
    (copy / "quality.json").write_text(json.dumps(whole))

    assert command.main(["--out", str(copy), "--against", str(study)]) == 2
    assert "no capture and held-out set in common" in capsys.readouterr().err
