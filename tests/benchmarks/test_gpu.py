import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gpu import run_steps
from gpu.command import main
from gpu.cuda_tests import list_test_files, summarize_report
from gpu.plan import STEPS, Step
from gpu.rows import Row, RowLog, format_table, write_tables
from gpu.run_steps import StepEnvironment, allot_time, run_step

_ROOT = Path(__file__).resolve().parents[2]
_PROGRAM = [sys.executable, str(_ROOT / "benchmarks" / "gpu.py")]


@pytest.fixture(scope="module")
def dry_run(tmp_path_factory):
    """The exit code and the output folder of a dry run."""
    folder = tmp_path_factory.mktemp("gpu")
    return main(["--out", str(folder), "--dry-run"]), folder


@pytest.mark.thorough
def test_a_dry_run_runs_every_step(dry_run):
    code, folder = dry_run
    rows = json.loads((folder / "gpu.json").read_text())["rows"]

    assert code == 0, (folder / "gpu.md").read_text()
    final_rows = [row for row in rows if row["what"] == "the step"]
    assert [row["step"] for row in final_rows] == [step.name for step in STEPS]
    assert all(row["holds"] for row in final_rows)
    assert sorted(path.name for path in folder.iterdir()) == ["gpu.json", "gpu.md"]


@pytest.mark.thorough
def test_a_dry_run_makes_all_requested_measurements(dry_run):
    _, folder = dry_run
    rows = json.loads((folder / "gpu.json").read_text())["rows"]
    rows_by_step = {}
    for row in rows:
        rows_by_step.setdefault(row["step"], []).append(row)

    comparison_rows = rows_by_step["backends"][:-1]
    assert {row["what"].split(",")[0] for row in comparison_rows} == {
        "numba against numba",
        "numba against torch",
    }
    assert all(0 <= row["figures"]["sh_relative"] < 1e-4 for row in comparison_rows)
    assert rows_by_step["tests"][0]["figures"]["tests"] >= 4
    stages = [
        row["what"] for row in rows_by_step["frame"] if row["what"].startswith("time of stage")
    ]
    assert stages == [
        f"time of stage {stage}" for stage in ("anchors", "motion", "placement", "births", "commit")
    ]
    assert "10 iterations" in rows_by_step["frame 0"][0]["what"]
    assert rows_by_step["frame 0"][1]["figures"]["psnr"] > 0
    assert rows_by_step["frame 0"][2]["what"] == "peak GPU memory"


@pytest.mark.thorough
def test_the_table_has_a_line_for_every_row(dry_run):
    _, folder = dry_run
    rows = json.loads((folder / "gpu.json").read_text())["rows"]
    lines = (folder / "gpu.md").read_text().splitlines()

    assert len(lines) == len(rows) + 2
    assert {line.count(" | ") for line in lines} == {4}


def _run_one(name, folder, time_limit=60.0, *, dry_run=True):
    (step,) = (step for step in STEPS if step.name == name)
    rows = []
    run_step(step, time_limit, StepEnvironment(folder, folder, dry_run, None), rows)
    return rows


@pytest.mark.thorough
def test_a_step_that_fails_says_why(tmp_path):
    (row,) = _run_one("frame 0", tmp_path)

    assert row == Row(
        "frame 0",
        "the step",
        "failed: RuntimeError: the scene has not been traced: the step `scene` must run first",
        "done",
        holds=False,
    )


def test_the_output_of_a_step_is_kept_if_it_fails_or_a_row_does_not_hold(tmp_path, monkeypatch):
    printing = [sys.executable, "-c", "print('first line'); print('last line')"]
    monkeypatch.setattr(run_steps, "_make_command", lambda *_: printing)
    log = tmp_path / "machine.log"

    assert _run_one("machine", tmp_path)[-1].holds
    assert not log.exists()

    RowLog(tmp_path / "machine.jsonl").add(Row("machine", "b", "c", holds=False))
    _run_one("machine", tmp_path)
    assert log.read_text() == "first line\nlast line\n"

    printing[-1] += "; raise SystemExit(1)"
    assert _run_one("machine", tmp_path)[-1].result == "failed: last line"
    assert log.read_text() == "first line\nlast line\n"


def test_a_step_finds_the_programs_of_packages(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", os.defpath)
    command = [sys.executable, "-c", "import os; print(os.environ['PATH']); raise SystemExit(1)"]
    monkeypatch.setattr(run_steps, "_make_command", lambda *_: command)
    rows = []

    run_step(STEPS[0], 60, StepEnvironment(tmp_path, tmp_path, True, tmp_path / "installed"), rows)

    folders = [str(tmp_path / "installed" / "bin"), str(Path(sys.executable).parent)]
    path = (tmp_path / "machine.log").read_text()
    assert path == os.pathsep.join([*folders, os.defpath]) + "\n"


def test_a_step_that_reaches_its_time_limit_is_stopped_and_its_results_are_kept(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(run_steps, "_MIN_STEP_SECONDS", 0)
    saved_row = Row("frame 0", "something", "1")
    row_log = RowLog(tmp_path / "frame_0.jsonl")
    row_log.add(saved_row)
    row_log.write_progress("canonical 3 of 10")
    start_time = time.monotonic()
    rows = _run_one("frame 0", tmp_path, 0.2)

    assert rows[0] == saved_row
    assert rows[1].result == "failed: not finished after 0 s (at canonical 3 of 10)"
    assert time.monotonic() - start_time < 30


def test_a_step_without_time_left_is_not_started(tmp_path):
    (row,) = _run_one("machine", tmp_path, 1.0)

    assert row.result == "failed: no time is left"
    assert list(tmp_path.iterdir()) == []


def test_no_step_takes_more_than_the_time_left():
    steps = (Step("a", 50, ""), Step("b", 500, ""))

    assert [time_limit for _, time_limit in allot_time(steps, 100)] == [
        50,
        pytest.approx(100, abs=5),
    ]


def test_the_time_limit_includes_the_installation_of_packages(tmp_path, monkeypatch, capsys):
    read_clock = time.monotonic

    def take_an_hour(_wheels):
        monkeypatch.setattr(time, "monotonic", lambda: read_clock() + 3600)
        return "nothing is missing"

    monkeypatch.setattr("gpu.command.install_missing", take_an_hour)

    main(["--out", str(tmp_path), "--wheels", str(tmp_path), "--dry-run"])

    assert "| machine | the step | failed: no time is left |" in capsys.readouterr().out


def test_without_a_gpu_only_the_gpu_check_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")
    code = main(["--out", str(tmp_path)])

    assert code == 1
    assert "torch finds no CUDA device; use --dry-run to run on the CPU" in capsys.readouterr().out
    rows = json.loads((tmp_path / "gpu.json").read_text())["rows"]
    assert {row["step"] for row in rows} == {"machine"}


@pytest.mark.skipif(os.name != "posix", reason="sends SIGTERM")
def test_an_interrupted_run_writes_the_table_of_completed_steps(tmp_path):
    command = [*_PROGRAM, "--dry-run", "--out", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(_ROOT)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment) as process:
        for _ in range(600):
            if (tmp_path / "gpu.md").exists():
                break
            time.sleep(0.1)
        time.sleep(0.5)  # the next step is running now
        process.send_signal(signal.SIGTERM)
        printed_text = process.communicate(timeout=60)[0].decode()

    assert process.returncode == 130
    assert printed_text == (tmp_path / "gpu.md").read_text()
    assert "| machine | the step | done in" in printed_text
    assert "failed: interrupted" in printed_text.splitlines()[-1]


def test_tests_are_found_by_their_marker():
    assert "test_rasterizers.py" in [path.name for path in list_test_files()]


@pytest.mark.parametrize(
    ("test_cases", "max_skipped", "holds", "message"),
    [
        ("<testcase name='a'/>", 0, True, "1 passed, 0 skipped, 0 failed"),
        ("<testcase name='a'><skipped/></testcase>", 0, False, "0 passed, 1 skipped, 0 failed"),
        ("<testcase name='a'><skipped/></testcase>", None, True, "0 passed, 1 skipped, 0 failed"),
        ("<testcase name='a'><failure/></testcase>", 0, False, "0 failed, 1 failed; a"),
        ("", None, False, "0 passed, 0 skipped, 0 failed"),
    ],
)
def test_tests_are_counted(tmp_path, test_cases, max_skipped, holds, message):
    counts = {name: test_cases.count(f"<{name}/>") for name in ("skipped", "failure")}
    total = test_cases.count("<testcase")
    report = tmp_path / "tests.xml"
    report.write_text(
        f"<testsuites><testsuite tests='{total}' skipped='{counts['skipped']}' "
        f"failures='{counts['failure']}' errors='0'>{test_cases}</testsuite></testsuites>"
    )
    row = summarize_report(report, max_skipped)

    assert (row.holds, row.result) == (
        holds,
        message.replace("0 failed, 1", "0 passed, 0 skipped, 1"),
    )


def test_cells_stay_within_their_columns():
    table = format_table([Row("a", "b|c", "line\nline", "", holds=False)])

    assert table.splitlines()[-1] == "| a | b/c | line line |  | **no** |"


def test_figures_that_are_not_numbers_do_not_break_the_json(tmp_path):
    write_tables([Row("a", "b", "c", figures={"good": 1.0, "bad": float("nan")})], tmp_path)

    (row,) = json.loads((tmp_path / "gpu.json").read_text())["rows"]
    assert row["figures"] == {"good": 1.0}


def test_an_incomplete_line_is_not_read(tmp_path):
    path = tmp_path / "notes.jsonl"
    RowLog(path).write_progress("1 of 2")
    with path.open("a") as file:
        file.write('{"row": {"st')

    assert RowLog(path).read() == ([], "1 of 2")
