import subprocess
import sys
import time

import pytest

from quarc_ref.jobs import Job, WorkerPool, run_jobs
from tests.jobs import works

_CALLER = """
import sys
from quarc_ref.jobs import Job, WorkerPool, run_jobs
from tests.jobs import works

if __name__ == "__main__":
    jobs = [Job(path, path) for path in sys.argv[1:]]
    run_jobs(works.sleep_with_file, jobs, WorkerPool(workers=2))
"""


def _wait_for_text(path):
    for _ in range(1500):
        if path.is_file() and (text := path.read_text()):
            return text
        time.sleep(0.02)
    return pytest.fail(f"nothing new is written into {path.name}")


def _is_quiet(path):
    """Whether the job that writes into a file has stopped."""
    for _ in range(100):
        contents_before = path.read_text()
        time.sleep(0.1)
        if path.read_text() == contents_before:
            return True
    return False


@pytest.mark.parametrize("signal_name", ["terminate", "kill"])
def test_no_job_outlives_its_caller(signal_name, tmp_path):
    notes = [tmp_path / "first", tmp_path / "second"]
    program = tmp_path / "caller.py"
    program.write_text(_CALLER)
    command = [sys.executable, program, *notes]
    with subprocess.Popen(command, env={"PYTHONPATH": "."}, stderr=subprocess.DEVNULL) as caller:
        for note in notes:
            _wait_for_text(note)
        getattr(caller, signal_name)()

    assert [_is_quiet(note) for note in notes] == [True, True]


def test_an_interruption_of_the_caller_ends_its_jobs(tmp_path):
    note = tmp_path / "note"

    def interrupt(*_of):
        _wait_for_text(note)
        raise KeyboardInterrupt

    jobs = [Job("long", str(note)), Job("none", None)]
    with pytest.raises(KeyboardInterrupt):
        run_jobs(works.sleep_with_file, jobs, WorkerPool(workers=2), interrupt)

    assert _is_quiet(note)


def test_an_interrupted_job_can_save_its_work(tmp_path, capfd):
    note = tmp_path / "note"

    def interrupt(*_of):
        _wait_for_text(note)
        raise KeyboardInterrupt

    jobs = [Job("long", str(note)), Job("none", None)]
    with pytest.raises(KeyboardInterrupt):
        run_jobs(works.sleep_until_interrupted, jobs, WorkerPool(workers=2), interrupt)

    assert note.read_text() == "interrupted"
    assert capfd.readouterr().err == ""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no masks of signals")
def test_ctrl_c_reaches_the_caller_but_no_job():
    jobs = [Job(name, None) for name in ("first", "second")]

    assert run_jobs(works.is_interrupt_blocked, jobs, WorkerPool()) == [True, True]
    assert not works.is_interrupt_blocked(None)
