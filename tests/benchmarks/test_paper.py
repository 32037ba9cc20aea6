"""Tests the command `paper.py` on a small capture with minimal training."""

import csv
import io
import json
import shutil
import subprocess
import sys
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path

import pytest

import studies
from paper import command
from quarc_ref.jobs import Job
from tests.datasets import scenes
from tests.jobs.in_process import run_jobs_in_this_process

TINY_OPTIONS = [
    "--preset", "demo", "--frames", "2",
    *("--set", "canonical.iterations=3", "--set", "motion.iterations=2"),
    *("--set", "births.iterations=2"),
]  # fmt: skip
ONLY_OPTION = ("--only", "full,quantization,gate,levels")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


def _run_paper(folder, output_path, *extra_options):
    return command.main([str(folder), "--out", str(output_path), *TINY_OPTIONS, *extra_options])


@contextmanager
def run_in_process():
    """Run jobs in this process; yield the list to which names of completed jobs are added."""
    completed_names = []

    def run_jobs_here(function, jobs: list[Job], _pool, report):
        for job in jobs:
            function(job.argument)
            completed_names.append(job.name)
            report(job.name, len(completed_names), len(jobs))

    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(studies, "run_jobs", run_jobs_here)
        yield completed_names


@pytest.fixture(scope="module")
def output_folder(folder, tmp_path_factory):
    """The output folder of a finished run."""
    path = tmp_path_factory.mktemp("study") / "out"
    with run_in_process() as names:
        assert _run_paper(folder, path, *ONLY_OPTION) == 0
    assert names == [
        "full",
        "no-updates",
        "float-motion",
        "float",
        "gate",
        "gate-open",
        "levels-1",
        "levels-2",
    ]
    return path


@pytest.fixture
def output_copy(output_folder, tmp_path):
    """A copy of the output folder, in which a test may run the command again."""
    return shutil.copytree(output_folder, tmp_path / "out")


@pytest.fixture
def completed_names():
    """Names of the trials that run during a test."""
    with run_in_process() as names:
        yield names


class _TextParser(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.words = []
        self.feed(text)

    def handle_data(self, data):
        self.words.append(data)


def test_tables_plots_and_page_are_written(output_folder):
    file_names = {path.name for path in output_folder.iterdir() if path.is_file()}
    plot_names = {"full.png", "quantization.png", "gate.png", "levels.png"}

    assert file_names == {"index.html", "paper.csv", "paper.md", *plot_names}
    assert (
        "| plane | PSNR loss caused by quantization, dB |"
        in (output_folder / "paper.md").read_text()
    )


def test_csv_has_a_line_for_each_trial_of_each_experiment(output_folder):
    lines = list(csv.DictReader(io.StringIO((output_folder / "paper.csv").read_text())))
    trial_names = [(line["experiment"], line["name"]) for line in lines]

    assert trial_names[:2] == [("full", "full"), ("quantization", "no-updates")]
    assert trial_names[-3:] == [("levels", name) for name in ("levels-1", "levels-2", "full")]
    assert lines[-3]["changes"] == "stream.level_count=1"
    assert float(lines[0]["seconds_motion"]) > 0
    assert "ssim_inria" in lines[0]["metric_ssim"]


def test_the_page_contains_its_pictures_and_states_the_protocol(output_folder):
    text = (output_folder / "index.html").read_text()
    words = " ".join(_TextParser(text).words)
    protocol = json.loads((output_folder / "rows" / "full.json").read_text())["protocol"]

    assert text.count("data:image/png;base64,") == 4
    assert "cameras held out from training (cam00)" in words
    assert "change gate: births with the gate / births without the gate" in words
    assert protocol["fingerprint"] in words
    assert protocol["versions"]["torch"] in words


def test_completed_trials_are_not_run_again(folder, output_copy, completed_names, capsys):
    _run_paper(folder, output_copy, *ONLY_OPTION, "--json")
    rows = json.loads(capsys.readouterr().out)

    assert completed_names == []
    assert [row["name"] for row in rows[:2]] == ["full", "no-updates"]
    assert rows[-1]["changes"] == {"stream.level_count": "2"}


def test_an_interrupted_run_resumes(folder, output_copy, completed_names):
    (output_copy / "rows" / "levels-1.json").unlink()
    _run_paper(folder, output_copy, *ONLY_OPTION)

    assert completed_names == ["levels-1"]


@pytest.mark.parametrize(
    ("extra_options", "message"),
    [
        (("--lpips", "none.pth"), "none.pth cannot be read: No such file"),
        (("--only", "steps"), "unknown experiments: steps; choose from full"),
        (("--set", "motion.speed=1"), "no setting 'motion.speed'"),
        (("--held-out", "cam77"), "cannot hold out camera cam77"),
        (("--workers", "0"), "workers and threads must be at least 1"),
    ],
)
def test_impossible_options_are_reported_before_anything_runs(
    folder, tmp_path, completed_names, capsys, extra_options, message
):
    assert _run_paper(folder, tmp_path, *extra_options) == 2
    assert message in capsys.readouterr().err
    assert completed_names == []
    assert not any(tmp_path.iterdir())


def test_a_failed_trial_does_not_stop_others(folder, tmp_path, capsys):
    (tmp_path / "rows" / "full.json").mkdir(parents=True)
    with run_jobs_in_this_process():
        code = _run_paper(folder, tmp_path, "--only", "rotation", "--workers", "2")

    assert code == 3
    assert "1 of 2 jobs failed; full: IsADirectoryError" in capsys.readouterr().err
    assert (tmp_path / "rows" / "rotation-4.json").is_file()


def test_rows_from_a_ray_cluster_equal_local_ones(folder, output_folder, tmp_path, ray_cluster):
    script = Path(command.__file__).parents[1] / "paper.py"
    options = [str(folder), "--out", str(tmp_path), *TINY_OPTIONS, "--only", "rotation"]
    subprocess.run([sys.executable, script, *options, "--ray", ray_cluster], check=True)

    assert (tmp_path / "rows" / "rotation-4.json").is_file()
    local_row, cluster_row = (
        json.loads((path / "rows" / "full.json").read_text()) for path in (output_folder, tmp_path)
    )
    assert local_row["bytes"] == cluster_row["bytes"]
    assert local_row["per_frame"] == cluster_row["per_frame"]


def test_several_captures_give_one_table_of_scenes_and_their_mean(
    folder, tmp_path, completed_names, capsys
):
    data = tmp_path / "N3DV"
    for name in ("one", "two"):
        shutil.copytree(folder, data / name)
    options = [str(data / "one"), str(data / "two"), "--out", str(tmp_path / "out"), *TINY_OPTIONS]
    assert command.main([*options, "--only", "full,gate"]) == 0
    printed_text = capsys.readouterr().out
    tables = (tmp_path / "out" / "scenes.md").read_text()
    with (tmp_path / "out" / "scenes.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))

    assert tables in printed_text
    assert "## N3DV" in tables
    lines_by_name = {
        line.split("|")[1].strip(): line for line in tables.splitlines() if "|" in line
    }
    assert {"one", "two", "mean", "change gate", "no gate"} <= lines_by_name.keys()
    psnr_values = [float(lines_by_name[name].split("|")[2]) for name in ("one", "two", "mean")]
    assert psnr_values[2] == pytest.approx((psnr_values[0] + psnr_values[1]) / 2, abs=0.01)
    assert [(line["scene"], line["label"]) for line in lines] == [
        (name, label) for name in ("one", "two")
        for label in ("full method", "change gate", "no gate")
    ]  # fmt: skip
    for name in ("one", "two"):
        assert (tmp_path / "out" / "N3DV" / name / "index.html").is_file()
    assert sorted(set(completed_names)) == ["full", "gate", "gate-open"]


def test_a_linked_capture_is_named_after_the_link(folder, tmp_path):
    data = tmp_path / "N3DV"
    data.mkdir()
    names = ("one", "two")
    for name in names:
        (data / name).symlink_to(folder)
    captures = [str(data / name) for name in names]
    arguments = command._parse_arguments([*captures, "--out", str(tmp_path), *TINY_OPTIONS])

    folders = [study.folder for study in command.plan_studies(arguments)]
    assert folders == [tmp_path / "N3DV" / name for name in names]


def test_ctrl_c_stops_all_captures_without_a_traceback(folder, tmp_path, monkeypatch, capsys):
    other_folder = tmp_path / "other"
    shutil.copytree(folder, other_folder)
    started = []

    def run_until_ctrl_c(_make_row, jobs, *_arguments):
        started.append(jobs)
        raise KeyboardInterrupt

    monkeypatch.setattr(studies, "run_jobs", run_until_ctrl_c)
    options = ["--out", str(tmp_path / "out"), *TINY_OPTIONS, "--only", "full"]

    assert command.main([str(folder), str(other_folder), *options]) == 130
    assert len(started) == 1
    assert "interrupted: run the same command again" in capsys.readouterr().err


def test_captures_of_the_same_name_are_rejected(folder, tmp_path, completed_names, capsys):
    assert (
        command.main([str(folder), str(folder), "--out", str(tmp_path / "out"), *TINY_OPTIONS]) == 2
    )
    assert "same name" in capsys.readouterr().err
    assert completed_names == []
