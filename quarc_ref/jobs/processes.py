"""Runs each job in a new process on this machine.

If a process is killed, only its job fails. All processes end when their parent process ends.
"""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING

from quarc_ref.jobs.job import Outcome, WorkerPool, run_call

if TYPE_CHECKING:
    Pipe = Connection[Outcome, Outcome]

# The threads of torch and numba do not survive a fork.
_SPAWN_CONTEXT = multiprocessing.get_context("spawn")
_TERMINATED_EXIT_CODE = 128 + signal.SIGTERM
_END_TIMEOUT_SECONDS = 10.0  # time after which a process that has not ended is killed


def run_in_processes(calls: Sequence[bytes], pool: WorkerPool) -> Iterator[tuple[int, Outcome]]:
    """Run each call in a new process; at most `pool.workers` processes run at the same time.

    Yields:
        Index and outcome of each call, in the order of completion.
    """
    running_processes: dict[Pipe, tuple[int, BaseProcess]] = {}
    try:
        for index, call in enumerate(calls):
            if len(running_processes) == pool.workers:
                yield from _collect_ended_processes(running_processes)
            pipe, process = _start_process(call, pool)
            running_processes[pipe] = (index, process)
        while running_processes:
            yield from _collect_ended_processes(running_processes)
    finally:
        for _, process in running_processes.values():
            process.terminate()
        for _, process in running_processes.values():
            _join_or_kill(process)


def _start_process(call: bytes, pool: WorkerPool) -> "tuple[Pipe, BaseProcess]":
    receiver, sender = _SPAWN_CONTEXT.Pipe(duplex=False)
    process = _SPAWN_CONTEXT.Process(target=_run_worker, args=(sender, call, pool.environment))
    with _change_environment(pool.environment), _block_interrupts():
        process.start()
    sender.close()  # now only the process has the sending end, so the pipe closes when it exits
    return receiver, process


def _collect_ended_processes(
    running_processes: "dict[Pipe, tuple[int, BaseProcess]]",
) -> Iterator[tuple[int, Outcome]]:
    """Wait until one or more processes end, remove these processes, and yield their outcomes."""
    for pipe in [pipe for pipe in running_processes if pipe in wait(list(running_processes))]:
        index, process = running_processes.pop(pipe)
        try:
            outcome = pipe.recv()
        except (EOFError, OSError):  # the process was killed before or while it sent its outcome
            outcome = None
        _join_or_kill(process)
        yield (
            index,
            outcome or Outcome(message=f"the process ended with exit code {process.exitcode}"),
        )


def _join_or_kill(process: BaseProcess) -> None:
    process.join(_END_TIMEOUT_SECONDS)
    process.kill()
    process.join()


@contextmanager
def _change_environment(new_values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for the processes that are started within this context.

    The variables cannot be set in `_run_worker`, because libraries may be loaded before it runs.
    """
    previous_values = {name: os.environ.get(name) for name in new_values}
    os.environ.update(new_values)
    try:
        yield
    finally:
        for name, value in previous_values.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _block_interrupts() -> Iterator[None]:
    """Block Ctrl-C within this context, and permanently in processes that are started within it.

    A terminal sends Ctrl-C to all processes. One that is not yet in `_run_worker` would print a
    traceback.
    """
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # otherwise, the first start of a process would unblock it
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _run_worker(pipe: "Pipe", call: bytes, environment: Mapping[str, str]) -> None:
    """Run a call in a new process, and send the outcome to the parent process."""
    # The parent process handles Ctrl-C, and terminates the new process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # SIGTERM raises KeyboardInterrupt, so that the job can save its work.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    try:
        pipe.send(run_call(call, environment))
    except KeyboardInterrupt:
        sys.exit(_TERMINATED_EXIT_CODE)


def _exit_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
