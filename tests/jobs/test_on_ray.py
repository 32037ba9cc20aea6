import os
import time

import pytest

from quarc_ref.jobs import Job, JobsError, WorkerPool, run_jobs
from tests.jobs import works


def _make_jobs(*arguments):
    return [Job(f"job {argument}", argument) for argument in arguments]


def _has_stopped(process):
    for _ in range(200):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def test_two_workers_of_a_cluster_run_in_parallel_and_results_keep_the_order(ray_cluster):
    reports = []
    jobs = _make_jobs(3, 1, 2, 5)

    results = run_jobs(
        works.square_slowly, jobs, WorkerPool(ray=ray_cluster), lambda *of: reports.append(of)
    )

    assert [square for square, _ in results] == [9, 1, 4, 25]
    assert len({process for _, process in results}) == 2
    assert [done for _, done, _ in reports] == [1, 2, 3, 4]


def test_failed_jobs_on_a_cluster_are_named(ray_cluster):
    with pytest.raises(JobsError) as error_info:
        run_jobs(works.fail_if_odd, _make_jobs(1, 2), WorkerPool(ray=ray_cluster))

    assert error_info.value.messages == {"job 1": "ValueError: 1 is odd"}


def test_a_job_on_a_cluster_has_its_threads(ray_cluster):
    pool = WorkerPool(threads=2, ray=ray_cluster)

    assert run_jobs(works.name_threads, _make_jobs(1), pool) == [(2, "2")]


def test_a_local_cluster_ends_with_its_jobs(ray_cluster):
    del ray_cluster  # its setting also affects this process
    processes = run_jobs(works.name_processes, _make_jobs(1), WorkerPool(ray="local"))

    assert [_has_stopped(process) for process in processes[0]] == [True, True]
