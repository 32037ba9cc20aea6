"""Tests the command `quality.py` on a tiny traced capture with minimal training."""

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
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.inspection.inspect_stream import inspect_stream
from tests.cli.commands import TINY
from tests.jobs.in_process import run_jobs_in_this_process

SETTINGS = [part for key, value in TINY.items() for part in ("--set", f"{key}={value}")]
CAPTURE_NAME = "fast-3-32x24"
OPTIONS = [
    "--variants",
    CAPTURE_NAME,
    "--frames",
    "2",
    "--seeds",
    "2",
    "--preset",
    "demo",
    *SETTINGS,
]


@pytest.fixture
def completed_names(monkeypatch):
    """Run jobs in this process; the list contains the names of completed jobs."""
    names = []

    def run_jobs_here(function, jobs, _pool, report):
        for job in jobs:
            function(job.argument)
            names.append(job.name)
            report(job.name, len(names), len(jobs))

    monkeypatch.setattr(studies, "run_jobs", run_jobs_here)
    return names


@pytest.fixture(scope="module")
def study_folder(tmp_path_factory):
    """The folder of a finished study."""
    path = tmp_path_factory.mktemp("quality") / "out"
    with run_jobs_in_this_process():
        assert command.main([*OPTIONS, "--out", str(path)]) == 0
    return path


@pytest.fixture
def study_copy(study_folder, tmp_path):
    """A copy of the study's folder, in which a test may run the command again."""
    return shutil.copytree(study_folder, tmp_path / "out")


def _read_row(folder, seed):
    return json.loads((folder / "rows" / f"{CAPTURE_NAME}.set0.seed{seed}.json").read_text())


def _read_csv(path):
    return list(csv.DictReader(io.StringIO(path.read_text())))


def test_the_figures_are_those_of_the_kept_stream(study_folder):
    row = _read_row(study_folder, 1)
    data = (study_folder / "streams" / f"{CAPTURE_NAME}.set0.seed1.quarc").read_bytes()
    evaluation = evaluate_stream(data, study_folder / "captures" / CAPTURE_NAME, lambda *_: None)
    summary, figures = inspect_stream(data), row["figures"]

    for name, value in evaluation.quality.mean().items():
        assert figures[f"held_out_{name}"] == pytest.approx(value)
    kinds = ("side", "canonical", "motion", "updates", "births", "other")
    assert sum(figures[f"bytes_{kind}"] for kind in kinds) == figures["bytes"] == len(data)
    assert figures["bytes_canonical"] == summary.frames[0].chunk_bytes
    assert figures["bytes_updates"] == summary.coded_bytes()["updates"] > 0
    assert figures["gaussians"] == summary.gaussian_count
    assert figures["seconds_first"] > 0
    assert figures["seconds_frame"] > 0
    assert figures["held_out_lpips"] is None
    assert summary.header.seed == row["seed"] == 1


def test_training_views_are_measured_with_gains_and_the_moving_region_separately(study_folder):
    row = _read_row(study_folder, 0)
    figures = row["figures"]

    assert figures["training_gain_psnr"] > figures["training_psnr"]
    assert figures["training_moving_gain_psnr"] != figures["training_static_gain_psnr"]
    assert figures["held_out_flicker"] is not None
    assert len(row["per_frame"]["training"]) == 2


def test_table_and_json_have_mean_and_deviation_over_seeds(study_folder):
    psnr_values = [_read_row(study_folder, seed)["figures"]["held_out_psnr"] for seed in (0, 1)]
    (group,) = json.loads((study_folder / "quality.json").read_text())["groups"]
    statistics = group["figures"]["held_out_psnr"]
    (line,) = _read_csv(study_folder / "quality.csv")

    assert statistics["mean"] == pytest.approx(np.mean(psnr_values))
    assert statistics["deviation"] == pytest.approx(np.std(psnr_values, ddof=1))
    assert float(line["held_out_psnr_mean"]) == statistics["mean"]
    assert line["held_out_lpips_mean"] == ""
    table_row = (
        f"| {CAPTURE_NAME}/0 | 2 | {statistics['mean']:.2f} +- {statistics['deviation']:.2f} |"
    )
    assert table_row in (study_folder / "quality.md").read_text()
    assert "| LPIPS |" not in (study_folder / "quality.md").read_text()


def test_there_is_a_line_for_each_frame_and_a_plot(study_folder):
    frames = _read_csv(study_folder / "frames.csv")

    assert [line["frame"] for line in frames] == ["0", "1"]
    assert float(frames[1]["training_moving_gain_psnr_mean"]) > 0
    assert (study_folder / "quality.png").read_bytes().startswith(b"\x89PNG")


def test_completed_trials_are_not_run_again(study_copy, completed_names):
    table_before = (study_copy / "quality.md").read_text()

    assert command.main([*OPTIONS, "--out", str(study_copy)]) == 0
    assert completed_names == []
    assert (study_copy / "quality.md").read_text() == table_before


def test_an_interrupted_study_resumes_in_a_separate_process(study_copy, capsys):
    stream = study_copy / "streams" / f"{CAPTURE_NAME}.set0.seed1.quarc"
    row, data = _read_row(study_copy, 1), stream.read_bytes()
    (study_copy / "rows" / f"{CAPTURE_NAME}.set0.seed1.json").unlink()
    stream.unlink()

    assert command.main([*OPTIONS, "--out", str(study_copy)]) == 0
    assert f"finished {CAPTURE_NAME}.set0.seed1: 1 of 1 jobs" in capsys.readouterr().err
    assert stream.read_bytes() == data
    assert _read_row(study_copy, 1)["per_frame"] == row["per_frame"]


def test_ctrl_c_leaves_the_table_of_completed_rows(study_copy, monkeypatch, capsys):
    def interrupt(*_arguments):
        raise KeyboardInterrupt

    (study_copy / "rows" / f"{CAPTURE_NAME}.set0.seed1.json").unlink()
    monkeypatch.setattr(studies, "run_jobs", interrupt)

    assert command.main([*OPTIONS, "--out", str(study_copy)]) == 130
    assert "interrupted: run the same command again" in capsys.readouterr().err
    assert f"| {CAPTURE_NAME}/0 | 1 |" in (study_copy / "quality.md").read_text()


def test_rows_with_other_settings_are_computed_again(study_copy, completed_names):
    options = [*OPTIONS, "--set", "motion.iterations=4", "--out", str(study_copy)]

    assert command.main(options) == 0
    assert completed_names == [f"{CAPTURE_NAME}.set0.seed{seed}" for seed in (0, 1)]


def test_two_studies_are_compared(study_folder, study_copy, capsys):
    document = json.loads((study_copy / "quality.json").read_text())
    figure = document["groups"][0]["figures"]["held_out_psnr"]
    figure["mean"] += 0.5
    (study_copy / "quality.json").write_text(json.dumps(document))

    assert command.main(["--out", str(study_copy), "--against", str(study_folder)]) == 0
    table = capsys.readouterr().out
    error = f"{figure['deviation']:.2f}"  # two seeds in each study: sqrt(s^2 / 2 + s^2 / 2)
    assert f"| {CAPTURE_NAME}/0 | +0.50 +- {error} |" in table
    assert f"| mean | +0.50 +- {error} |" in table


def test_a_comparison_of_different_numbers_of_frames_is_named(study_folder, study_copy, capsys):
    document = json.loads((study_copy / "quality.json").read_text())
    document["groups"][0]["frames"] = 7
    (study_copy / "quality.json").write_text(json.dumps(document))

    assert command.main(["--out", str(study_copy), "--against", str(study_folder)]) == 0
    message = f"{CAPTURE_NAME}/0: the studies have different numbers of frames, 7 and 2"
    assert message in capsys.readouterr().err


def test_a_real_capture_has_four_held_out_sets(study_folder, tmp_path):
    arguments = command._parse_arguments(
        ["--out", str(tmp_path), "--variants", "", "--seeds", "1", "--downscale", "2"]
    )
    arguments.real = arguments.still = study_folder / "captures" / CAPTURE_NAME
    with pytest.raises(ValueError, match="3 cameras are too few"):
        command.plan_study(arguments)

    arguments.real = None
    (task,) = command.plan_study(arguments).tasks
    assert (task.name, task.options.held_out) == ("still.set0.seed0", ("cam00",))
    assert open_capture(task.source, task.options).cameras[0].width == 16


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--variants", "night"], "'night' is not a traced capture"),
        (["--variants", ""], "no capture is given"),
        (["--variants", CAPTURE_NAME, "--set", "motion.speed=1"], "no setting 'motion.speed'"),
        (["--variants", CAPTURE_NAME, "--workers", "0"], "workers and threads must be at least 1"),
        (["--lpips", "none.pth"], "none.pth cannot be read: No such file"),
        (["--real", "nowhere"], "nowhere"),
        (["--against", "nowhere"], "quality.json does not exist: run the study first"),
    ],
)
def test_impossible_options_are_rejected_before_anything_runs(
    options, message, tmp_path, completed_names, capsys
):
    assert command.main([*options, "--out", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert completed_names == []
    assert not any(tmp_path.iterdir())


def test_pictures_too_small_for_lpips_are_rejected_before_the_first_encode(
    study_folder, tmp_path, monkeypatch, completed_names, capsys
):
    monkeypatch.setattr(command, "Lpips", lambda _: object.__new__(Lpips))  # without weights
    options = [*OPTIONS, "--captures", str(study_folder / "captures"), "--lpips", "weights.pth"]

    assert command.main([*options, "--downscale", "2", "--out", str(tmp_path)]) == 2
    assert "LPIPS needs pictures of at least 16 x 16 pixels" in capsys.readouterr().err
    assert completed_names == []


def test_studies_of_other_captures_are_not_compared(study_copy, study_folder, capsys):
    document = json.loads((study_copy / "quality.json").read_text())
    document["groups"][0]["capture"] = "another"
    (study_copy / "quality.json").write_text(json.dumps(document))

    assert command.main(["--out", str(study_copy), "--against", str(study_folder)]) == 2
    assert "no capture and held-out set in common" in capsys.readouterr().err
