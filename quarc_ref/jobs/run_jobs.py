"""Run jobs, here or on a cluster, and collect their results."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from quarc_ref.jobs.job import Argument, Job, Outcome, Result, WorkerPool, pack_call, take_results
from quarc_ref.jobs.on_ray import run_on_ray
from quarc_ref.jobs.processes import run_in_processes


def run_jobs(
    function: Callable[[Argument], Result],
    jobs: Sequence[Job[Argument]],
    pool: WorkerPool,
    on_done: Callable[[str, int, int], object] | None = None,
) -> list[Result]:
    """Call a function once for every job, each in a process of its own.

    A job that fails does not stop the others. If the caller is interrupted or
    killed, the jobs end with it: a job that may be rerun should save its progress in files.

    Args:
        function: Must be importable by name where the jobs run, and return a picklable result.
        jobs: Jobs, in the order in which they are started.
        pool: Processes of this machine, or a Ray cluster. Files that jobs name must exist there.
        on_done: Called after each job with its name, how many are over, and
            how many there are.

    Returns:
        The results in the order of the jobs.

    Raises:
        JobsError: Some jobs have failed; the results of the others are lost.
        ImportError: Ray is asked for and not installed.
        ConnectionError: No Ray cluster is at the address.
    """
    outcomes: dict[int, Outcome] = {}
    for place, outcome in _run(function, jobs, pool):
        outcomes[place] = outcome
        if on_done is not None:
            on_done(jobs[place].name, len(outcomes), len(jobs))
    return take_results(jobs, outcomes)


def _run(
    function: Callable[[Any], Any], jobs: Sequence[Job[Any]], pool: WorkerPool
) -> Iterator[tuple[int, Outcome]]:
    calls = [pack_call(function, job.argument) for job in jobs]
    return run_in_processes(calls, pool) if pool.ray is None else run_on_ray(calls, pool)
