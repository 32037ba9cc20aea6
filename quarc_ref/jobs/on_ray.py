"""Jobs as tasks of a Ray cluster, which restarts a task whose machine is lost."""

import logging
from collections.abc import Iterator, Sequence
from typing import Any

from quarc_ref.jobs.job import Outcome, WorkerPool, attempt

_LOCAL = "local"


def run_on_ray(calls: Sequence[bytes], pool: WorkerPool) -> Iterator[tuple[int, Outcome]]:
    """Make calls, as many at a time as the cluster has room for.

    Yields:
        The index of each call and its outcome, as they end.

    Raises:
        ImportError: Ray is not installed.
        ConnectionError: No cluster is at the address.
    """
    import ray

    # A cluster that is started here is as large as was asked for, and serves no pages.
    here: dict[str, Any] = {"num_cpus": pool.workers * pool.threads, "include_dashboard": False}
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.WARNING}
    ray.init(pool.ray, **quiet, **(here if pool.ray == _LOCAL else {}))
    try:
        task = ray.remote(num_cpus=pool.threads, num_gpus=pool.gpus)(attempt)
        places = {task.remote(call, pool.environment): place for place, call in enumerate(calls)}
        while places:
            ended, _ = ray.wait(list(places))
            for reference in ended:
                yield places.pop(reference), _take_outcome(reference)
    finally:
        ray.shutdown()


def _take_outcome(reference: Any) -> Outcome:  # noqa: ANN401
    """Return the outcome of a task that has ended."""
    import ray

    try:
        outcome: Outcome = ray.get(reference)
    except ray.exceptions.RayError as error:
        return Outcome(fault=f"Ray could not run the job: {error}")
    return outcome
