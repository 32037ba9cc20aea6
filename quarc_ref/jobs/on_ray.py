"""Runs jobs as tasks of a Ray cluster, which restarts tasks of lost machines."""

import logging
from collections.abc import Iterator, Sequence
from typing import Any

from quarc_ref.jobs.job import Outcome, WorkerPool, run_call

_LOCAL = "local"


def run_on_ray(calls: Sequence[bytes], pool: WorkerPool) -> Iterator[tuple[int, Outcome]]:
    """Run calls on a Ray cluster, which determines how many calls run at the same time.

    Yields:
        Index and outcome of each call, in the order of completion.

    Raises:
        ImportError: Ray is not installed.
        ConnectionError: There is no Ray cluster at the address.
    """
    import ray

    # A local cluster has the requested size and no dashboard.
    here: dict[str, Any] = {"num_cpus": pool.workers * pool.threads, "include_dashboard": False}
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.WARNING}
    ray.init(pool.ray, **quiet, **(here if pool.ray == _LOCAL else {}))
    try:
        task = ray.remote(num_cpus=pool.threads, num_gpus=pool.gpus)(run_call)
        places = {task.remote(call, pool.environment): place for place, call in enumerate(calls)}
        while places:
            ended, _ = ray.wait(list(places))
            for reference in ended:
                yield places.pop(reference), _get_outcome(reference)
    finally:
        ray.shutdown()


def _get_outcome(reference: Any) -> Outcome:  # noqa: ANN401
    """Return the outcome of a completed task."""
    import ray

    try:
        outcome: Outcome = ray.get(reference)
    except ray.exceptions.RayError as error:
        return Outcome(fault=f"Ray could not run the job: {error}")
    return outcome
