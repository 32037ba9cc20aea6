"""Jobs, where they run, and their outcomes."""

import os
import pickle
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Argument = TypeVar("Argument")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Job(Generic[Argument]):
    """A call that depends on no other.

    Attributes:
        name: For messages.
        argument: Argument of the function; must be picklable.
    """

    name: str
    argument: Argument


@dataclass(frozen=True, slots=True)
class WorkerPool:
    """Where jobs run.

    Attributes:
        workers: Processes of this machine at a time; of a cluster, what its
            processors bear.
        threads: Threads of each job.
        ray: Address of a Ray cluster, as `ray.init` takes it: `host:port`,
            `ray://host:port`, `auto` for one that runs on this machine, or
            `local` for one that is started here and ended with the jobs. None
            for processes of this machine.
        gpus: Share of a GPU that each job takes of a cluster.

    Raises:
        ValueError: A number is out of range.
    """

    workers: int = 1
    threads: int = 1
    ray: str | None = None
    gpus: float = 0.0

    def __post_init__(self) -> None:
        if self.workers < 1 or self.threads < 1 or self.gpus < 0:
            message = "workers and threads must be at least 1, gpus at least 0"
            raise ValueError(message)

    @property
    def environment(self) -> dict[str, str]:
        """Environment that limits the libraries of a job to its threads, if set before loading."""
        names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "MKL_NUM_THREADS")
        return dict.fromkeys(names, str(self.threads))


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a job.

    Attributes:
        result: Result of the function, pickled; empty if it raised.
        fault: A line; empty if there was none.
        details: The traceback of the fault.
    """

    result: bytes = b""
    fault: str = ""
    details: str = ""


class JobsError(RuntimeError):
    """Some jobs have failed; all others are done.

    Args:
        outcomes: Outcomes of the failed jobs, by name.
        total: How many jobs there were.

    Attributes:
        faults: A line on each, by name.
    """

    def __init__(self, outcomes: Mapping[str, Outcome], total: int) -> None:
        self.faults = {name: outcome.fault for name, outcome in outcomes.items()}
        lines = [f"{name}: {fault}" for name, fault in self.faults.items()]
        super().__init__("; ".join([f"{len(lines)} of {total} jobs failed", *lines]))
        for name, outcome in outcomes.items():
            self.add_note(f"{name}:\n{outcome.details}")


def pack_call(function: Callable[[Any], Any], argument: object) -> bytes:
    """Return a call as bytes, so that its libraries are imported only where it runs."""
    return pickle.dumps((function, argument))


def attempt(call: bytes, environment: Mapping[str, str]) -> Outcome:
    """Make a call where it is to run.

    Args:
        call: Call packed by `pack_call`.
        environment: Environment variables, set before the call.
    """
    os.environ.update(environment)
    try:
        function, argument = pickle.loads(call)
        return Outcome(pickle.dumps(function(argument)))
    except Exception as error:  # any fault of a job is its own result
        return Outcome(fault=f"{type(error).__name__}: {error}", details=traceback.format_exc())


def take_results(jobs: Sequence[Job[Any]], outcomes: Mapping[int, Outcome]) -> list[Any]:
    """Return the results in the order of the jobs.

    Args:
        jobs: All of them.
        outcomes: Outcome of each job, by its index.

    Raises:
        JobsError: Some have failed.
    """
    failed = {job.name: outcomes[place] for place, job in enumerate(jobs) if outcomes[place].fault}
    if failed:
        raise JobsError(failed, len(jobs))
    return [pickle.loads(outcomes[place].result) for place in range(len(jobs))]
