"""Runs jobs, locally or on a cluster, and collects their results."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from quarc_ref.jobs.job import Argument, Job, Outcome, Result, WorkerPool, load_results, pickle_call
from quarc_ref.jobs.on_ray import run_on_ray
from quarc_ref.jobs.processes import run_in_processes


def run_jobs(
    function: Callable[[Argument], Result],
    jobs: Sequence[Job[Argument]],
    pool: WorkerPool,
    on_done: Callable[[str, int, int], object] | None = None,
) -> list[Result]:
    """Call a function once per job, and run each call in a separate process.

    A job that fails does not stop other jobs. If the caller is interrupted or killed, its jobs end
    as well, so long jobs should save their progress in files.

    Args:
        function: Function that workers can import by name, and that returns a picklable result.
        jobs: Jobs in the order in which they start.
        pool: Local processes, or a Ray cluster that can access the files of the jobs.
        on_done: Function to call after each job, with the name of the job, the number of completed
            jobs and the total number of jobs.

    Returns:
        The results in the order of the jobs.

    Raises:
        JobsError: Some jobs have failed; the results of all other jobs are discarded.
        ImportError: Ray is requested but not installed.
        ConnectionError: There is no Ray cluster at the address.
    """
    outcomes: dict[int, Outcome] = {}
    for index, outcome in _run_calls(function, jobs, pool):
        outcomes[index] = outcome
        if on_done is not None:
            on_done(jobs[index].name, len(outcomes), len(jobs))
    return load_results(jobs, outcomes)


def _run_calls(
    function: Callable[[Any], Any], jobs: Sequence[Job[Any]], pool: WorkerPool
) -> Iterator[tuple[int, Outcome]]:
    calls = [pickle_call(function, job.argument) for job in jobs]
    return run_in_processes(calls, pool) if pool.ray is None else run_on_ray(calls, pool)
