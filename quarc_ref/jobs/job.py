"""Data types for jobs, worker pools and outcomes, and functions that run a pickled call."""

import os
import pickle
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Argument = TypeVar("Argument")
Result = TypeVar("Result")

LOCAL_CLUSTER = "local"  # address of a temporary Ray cluster on this machine


@dataclass(frozen=True, slots=True)
class Job(Generic[Argument]):
    """One call of a function; it does not depend on any other call.

    Attributes:
        name: Name of the job in messages.
        argument: Argument of the function; must be picklable.
    """

    name: str
    argument: Argument


@dataclass(frozen=True, slots=True)
class WorkerPool:
    """The local processes or the Ray cluster that run jobs.

    Attributes:
        workers: Maximum number of jobs that run at the same time in local processes or on a `local`
            cluster.
        threads: Number of threads of each job.
        ray: Address of a Ray cluster for `ray.init`: `host:port`, `ray://host:port`, `auto` for
            a running cluster on this machine, or `local` for a temporary cluster. If `ray` is
            None, jobs run in local processes.
        gpus: Number of GPUs that each job occupies on the cluster; may be a fraction.

    Raises:
        ValueError: A number is out of range.
    """

    workers: int = 1
    threads: int = 1
    ray: str | None = None
    gpus: float = 0.0

    def __post_init__(self) -> None:
        if self.workers < 1 or self.threads < 1 or self.gpus < 0:
            message = "workers and threads must be at least 1, and gpus must be at least 0"
            raise ValueError(message)

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables that limit the number of threads that a job's libraries use."""
        variable_names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "MKL_NUM_THREADS")
        return dict.fromkeys(variable_names, str(self.threads))


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a job.

    Attributes:
        result: Pickled return value of the function; empty if there was an error.
        message: Error message in one line; empty if there was no error.
        details: Traceback of the error; empty if there was no error.
    """

    result: bytes = b""
    message: str = ""
    details: str = ""


class JobsError(RuntimeError):
    """Some jobs have failed; all other jobs are complete.

    Args:
        outcomes: Outcomes of the failed jobs, by job name.
        job_count: Number of all jobs.

    Attributes:
        messages: Error message of each failed job, by job name.
    """

    def __init__(self, outcomes: Mapping[str, Outcome], job_count: int) -> None:
        self.messages = {name: outcome.message for name, outcome in outcomes.items()}
        failure_lines = [f"{name}: {message}" for name, message in self.messages.items()]
        super().__init__(
            "; ".join([f"{len(failure_lines)} of {job_count} jobs failed", *failure_lines])
        )
        for name, outcome in outcomes.items():
            self.add_note(f"{name}:\n{outcome.details}")


def pickle_call(function: Callable[[Any], Any], argument: object) -> bytes:
    """Pickle a function and its argument; a worker imports their modules when it unpickles them."""
    return pickle.dumps((function, argument))


def run_call(call: bytes, environment: Mapping[str, str]) -> Outcome:
    """Run a pickled call, and return its result or its error.

    Args:
        call: Pickled call from `pickle_call`.
        environment: Environment variables to set before the call.
    """
    os.environ.update(environment)
    try:
        function, argument = pickle.loads(call)
        return Outcome(pickle.dumps(function(argument)))
    except Exception as error:  # any error of a job is its outcome
        return Outcome(message=f"{type(error).__name__}: {error}", details=traceback.format_exc())


def load_results(jobs: Sequence[Job[Any]], outcomes: Mapping[int, Outcome]) -> list[Any]:
    """Unpickle the results, and return them in the order of the jobs.

    Args:
        jobs: All jobs.
        outcomes: Outcome of each job, by its index.

    Raises:
        JobsError: Some jobs have failed.
    """
    failed_outcomes = {
        job.name: outcomes[index] for index, job in enumerate(jobs) if outcomes[index].message
    }
    if failed_outcomes:
        raise JobsError(failed_outcomes, len(jobs))
    return [pickle.loads(outcomes[index].result) for index in range(len(jobs))]
