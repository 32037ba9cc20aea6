"""The whole command on a small capture, with minimal training."""

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

TINY = [
    "--preset", "demo", "--frames", "2",
    *("--set", "canonical.iterations=3", "--set", "motion.iterations=2"),
    *("--set", "births.iterations=2"),
]  # fmt: skip
ONLY = ("--only", "full,quantization,gate,levels")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


def _run(folder, out, *more):
    return command.main([str(folder), "--out", str(out), *TINY, *more])


@contextmanager
def run_in_process():
    """Run jobs in this process; return the list of the names of completed jobs."""
    ran = []

    def run(function, jobs: list[Job], _where, reported):
        for job in jobs:
            function(job.argument)
            ran.append(job.name)
            reported(job.name, len(ran), len(jobs))

    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(studies, "run_jobs", run)
        yield ran


@pytest.fixture(scope="module")
def study(folder, tmp_path_factory):
    """The folder of a finished run."""
    out = tmp_path_factory.mktemp("study") / "out"
    with run_in_process() as ran:
        assert _run(folder, out, *ONLY) == 0
    assert ran == [
        "full",
        "float-motion",
        "float",
        "gate",
        "gate-open",
        "levels-1",
        "levels-2",
    ]
    return out


@pytest.fixture
def copy(study, tmp_path):
    """The same, to resume."""
    return shutil.copytree(study, tmp_path / "out")


@pytest.fixture
def here():
    """The names of the trials that run."""
    with run_in_process() as ran:
        yield ran


class _TextParser(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.words = []
        self.feed(text)

    def handle_data(self, data):
        self.words.append(data)


def test_tables_plots_and_page_are_written(study):
    names = {path.name for path in study.iterdir() if path.is_file()}
    plots = {"full.png", "quantization.png", "gate.png", "levels.png"}

    assert names == {"index.html", "paper.csv", "paper.md", *plots}
    assert "| plane | dB that quantization costs |" in (study / "paper.md").read_text()


def test_csv_has_a_line_for_each_trial_of_each_experiment(study):
    lines = list(csv.DictReader(io.StringIO((study / "paper.csv").read_text())))
    named = [(line["experiment"], line["name"]) for line in lines]

    assert named[:2] == [("full", "full"), ("quantization", "full")]
    assert named[-3:] == [("levels", name) for name in ("levels-1", "levels-2", "full")]
    assert lines[-3]["changes"] == "stream.level_count=1"
    assert float(lines[0]["seconds_motion"]) > 0
    assert "ssim_inria" in lines[0]["metric_ssim"]


def test_the_page_contains_its_pictures_and_states_the_protocol(study):
    text = (study / "index.html").read_text()
    words = " ".join(_TextParser(text).words)
    protocol = json.loads((study / "rows" / "full.json").read_text())["protocol"]

    assert text.count("data:image/png;base64,") == 4
    assert "cam00, held out from training" in words
    assert "change gate: births / those without" in words
    assert protocol["fingerprint"] in words
    assert protocol["versions"]["torch"] in words


def test_completed_trials_are_not_run_again(folder, copy, here, capsys):
    _run(folder, copy, *ONLY, "--json")
    rows = json.loads(capsys.readouterr().out)

    assert here == []
    assert [row["name"] for row in rows[:2]] == ["full", "float-motion"]
    assert rows[-1]["changes"] == {"stream.level_count": "2"}


def test_an_interrupted_run_resumes(folder, copy, here):
    (copy / "rows" / "levels-1.json").unlink()
    _run(folder, copy, *ONLY)

    assert here == ["levels-1"]


@pytest.mark.parametrize(
    ("more", "reported"),
    [
        (("--lpips", "none.pth"), "none.pth is not a readable file of LPIPS weights"),
        (("--only", "steps"), "unknown experiments steps; known are full"),
        (("--set", "motion.speed=1"), "no setting 'motion.speed'"),
        (("--held-out", "cam77"), "cannot hold out camera cam77"),
        (("--workers", "0"), "workers and threads must be at least 1"),
    ],
)
def test_impossible_options_are_reported_before_anything_runs(
    folder, tmp_path, here, capsys, more, reported
):
    assert _run(folder, tmp_path, *more) == 2
    assert reported in capsys.readouterr().err
    assert here == []
    assert not any(tmp_path.iterdir())


def test_a_failed_trial_does_not_stop_others_in_worker_processes(folder, tmp_path, capsys):
    (tmp_path / "rows" / "full.json").mkdir(parents=True)
    code = _run(folder, tmp_path, "--only", "rotation", "--workers", "2")

    assert code == 3
    assert "1 of 2 jobs failed; full: IsADirectoryError" in capsys.readouterr().err
    assert (tmp_path / "rows" / "rotation-4.json").is_file()


def test_rows_from_a_ray_cluster_equal_local_ones(folder, study, tmp_path, ray_cluster):
    script = Path(command.__file__).parents[1] / "paper.py"
    words = [str(folder), "--out", str(tmp_path), *TINY, "--only", "rotation"]
    subprocess.run([sys.executable, script, *words, "--ray", ray_cluster], check=True)

    assert (tmp_path / "rows" / "rotation-4.json").is_file()
    mine, theirs = (
        json.loads((place / "rows" / "full.json").read_text()) for place in (study, tmp_path)
    )
    assert mine["bytes"] == theirs["bytes"]
    assert mine["per_frame"] == theirs["per_frame"]


def test_several_captures_give_one_table_of_scenes_and_their_mean(folder, tmp_path, here, capsys):
    data = tmp_path / "N3DV"
    for name in ("one", "two"):
        shutil.copytree(folder, data / name)
    words = [str(data / "one"), str(data / "two"), "--out", str(tmp_path / "out"), *TINY]
    assert command.main([*words, "--only", "full,gate"]) == 0
    printed = capsys.readouterr().out
    tables = (tmp_path / "out" / "scenes.md").read_text()
    with (tmp_path / "out" / "scenes.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))

    assert tables in printed
    assert "## N3DV" in tables
    rows = {line.split("|")[1].strip(): line for line in tables.splitlines() if "|" in line}
    assert {"one", "two", "mean", "change gate", "no gate"} <= rows.keys()
    numbers = [float(rows[name].split("|")[2]) for name in ("one", "two", "mean")]
    assert numbers[2] == pytest.approx((numbers[0] + numbers[1]) / 2, abs=0.01)
    assert [(line["scene"], line["label"]) for line in lines] == [
        (name, label) for name in ("one", "two")
        for label in ("full method", "change gate", "no gate")
    ]  # fmt: skip
    for name in ("one", "two"):
        assert (tmp_path / "out" / "N3DV" / name / "index.html").is_file()
    assert sorted(set(here)) == ["full", "gate", "gate-open"]


def test_captures_of_the_same_name_are_rejected(folder, tmp_path, here, capsys):
    assert command.main([str(folder), str(folder), "--out", str(tmp_path / "out"), *TINY]) == 2
    assert "same name" in capsys.readouterr().err
    assert here == []
