import os

import pytest

from quarc_ref.jobs import Job, JobsError, WorkerPool, run_jobs
from tests.jobs import works

TWO_WORKERS = WorkerPool(workers=2)


def _make_jobs(*arguments):
    return [Job(f"job {argument}", argument) for argument in arguments]


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_results_are_in_the_order_of_the_jobs(workers):
    assert run_jobs(works.square, _make_jobs(3, 1, 2), WorkerPool(workers)) == [9, 1, 4]


def test_no_jobs_have_no_results():
    assert run_jobs(works.square, [], TWO_WORKERS) == []


def test_every_finished_job_is_reported():
    reports = []
    run_jobs(works.square, _make_jobs(3, 1), WorkerPool(), lambda *of: reports.append(of))

    assert reports == [("job 3", 1, 2), ("job 1", 2, 2)]


def test_every_job_has_its_own_process_and_threads(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "7")
    contents_before = dict(os.environ)
    processes = run_jobs(works.name_processes, _make_jobs(1, 2), TWO_WORKERS)

    assert len({process for process, _ in processes}) == 2
    assert {caller for _, caller in processes} == {os.getpid()}
    assert run_jobs(works.name_threads, _make_jobs(1), WorkerPool(threads=3)) == [(3, "3")]
    assert os.environ == contents_before


def test_failed_jobs_are_named_when_all_others_are_done():
    reports = []
    with pytest.raises(JobsError) as error_info:
        run_jobs(
            works.fail_if_odd, _make_jobs(1, 2, 3), TWO_WORKERS, lambda *of: reports.append(of)
        )

    assert error_info.value.messages == {
        "job 1": "ValueError: 1 is odd",
        "job 3": "ValueError: 3 is odd",
    }
    assert str(error_info.value).startswith(
        "2 of 3 jobs failed; job 1: ValueError: 1 is odd; job 3"
    )
    assert "in fail_if_odd" in error_info.value.__notes__[0]
    assert len(reports) == 3


@pytest.mark.parametrize("function", [works.kill_self_if_odd, works.die_while_sending_if_odd])
def test_a_crashed_process_fails_only_its_own_job(function):
    with pytest.raises(JobsError) as error_info:
        run_jobs(function, _make_jobs(1, 2), WorkerPool())

    assert error_info.value.messages == {"job 1": "the process ended with exit code -9"}


def test_a_result_that_cannot_be_pickled_is_an_error_of_the_job():
    with pytest.raises(JobsError, match=r"job 1: .*pickle"):
        run_jobs(works.return_no_value, _make_jobs(1), WorkerPool())


@pytest.mark.parametrize("numbers", [{"workers": 0}, {"threads": 0}, {"gpus": -1}])
def test_invalid_places_are_rejected(numbers):
    with pytest.raises(ValueError, match="at least"):
        WorkerPool(**numbers)
