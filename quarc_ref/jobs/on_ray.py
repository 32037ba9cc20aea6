"""Runs jobs as tasks on a Ray cluster, which reruns the tasks of machines that fail."""

import logging
from collections.abc import Iterator, Sequence
from typing import Any

from quarc_ref.jobs.job import LOCAL_CLUSTER, Outcome, WorkerPool, run_call


def require_ray() -> None:
    """Raise ImportError if Ray is not installed."""
    import ray  # noqa: F401


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
    local_options: dict[str, Any] = {
        "num_cpus": pool.workers * pool.threads,
        "include_dashboard": False,
    }
    logging_options: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.WARNING}
    ray.init(pool.ray, **logging_options, **(local_options if pool.ray == LOCAL_CLUSTER else {}))
    try:
        task = ray.remote(num_cpus=pool.threads, num_gpus=pool.gpus)(run_call)
        indices_by_task = {
            task.remote(call, pool.environment): index for index, call in enumerate(calls)
        }
        while indices_by_task:
            ended_tasks, _ = ray.wait(list(indices_by_task))
            for reference in ended_tasks:
                yield indices_by_task.pop(reference), _get_outcome(reference)
    finally:
        ray.shutdown()


def _get_outcome(reference: Any) -> Outcome:  # noqa: ANN401
    """Return the outcome of a completed task."""
    import ray

    try:
        outcome: Outcome = ray.get(reference)
    except ray.exceptions.RayError as error:
        return Outcome(message=f"Ray could not run the job: {error}")
    return outcome
