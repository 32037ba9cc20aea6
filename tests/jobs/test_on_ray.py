import os
import sys
import time
from types import SimpleNamespace

import pytest

from quarc_ref.jobs import Job, JobsError, WorkerPool, run_jobs
from quarc_ref.jobs.on_ray import run_on_ray
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


@pytest.mark.parametrize(("address", "cpus"), [("local", 6), ("auto", None)])
def test_a_local_cluster_has_processors_for_all_threads_of_all_jobs(address, cpus, monkeypatch):
    given_options = {}
    stub = SimpleNamespace(
        init=lambda address, **options: given_options.update(options, address=address),
        remote=lambda **options: given_options.update(task=options) or (lambda function: function),
        shutdown=lambda: None,
    )
    monkeypatch.setitem(sys.modules, "ray", stub)
    assert list(run_on_ray([], WorkerPool(workers=2, threads=3, ray=address, gpus=0.5))) == []

    assert (given_options["address"], given_options.get("num_cpus")) == (address, cpus)
    assert given_options["task"] == {"num_cpus": 3, "num_gpus": 0.5}
