"""Runs each job in a new process on this machine.

If a process is killed, only the job of that process fails. All processes end when their parent
process ends.
"""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING

from quarc_ref.jobs.job import Outcome, WorkerPool, run_call

if TYPE_CHECKING:
    Pipe = Connection[Outcome, Outcome]

_SPAWN = multiprocessing.get_context("spawn")  # torch and numba threads do not survive a fork
_TERMINATED = 128 + signal.SIGTERM
_PATIENCE = 10.0  # seconds before a process that does not end is killed


def run_in_processes(calls: Sequence[bytes], pool: WorkerPool) -> Iterator[tuple[int, Outcome]]:
    """Run each call in a new process; at most `pool.workers` processes run at the same time.

    Yields:
        Index and outcome of each call, in the order of completion.
    """
    running: dict[Pipe, tuple[int, BaseProcess]] = {}
    try:
        for place, call in enumerate(calls):
            if len(running) == pool.workers:
                yield from _wait_for_ended(running)
            pipe, process = _start(call, pool)
            running[pipe] = (place, process)
        while running:
            yield from _wait_for_ended(running)
    finally:
        for _, process in running.values():
            process.terminate()
        for _, process in running.values():
            _await_end(process)


def _start(call: bytes, pool: WorkerPool) -> "tuple[Pipe, BaseProcess]":
    ours, theirs = _SPAWN.Pipe(duplex=False)
    process = _SPAWN.Process(target=_work, args=(theirs, call, pool.environment))
    with _environment(pool.environment):
        process.start()
    theirs.close()  # now only the process has the sending end, so the pipe closes when it exits
    return ours, process


def _wait_for_ended(
    running: "dict[Pipe, tuple[int, BaseProcess]]",
) -> Iterator[tuple[int, Outcome]]:
    """Wait until a process ends, remove all ended processes, and yield their outcomes."""
    for pipe in [pipe for pipe in running if pipe in wait(list(running))]:
        place, process = running.pop(pipe)
        try:
            outcome = pipe.recv()
        except EOFError:
            outcome = None
        _await_end(process)
        yield (
            place,
            outcome or Outcome(fault=f"the process ended with exit code {process.exitcode}"),
        )


def _await_end(process: BaseProcess) -> None:
    process.join(_PATIENCE)
    process.kill()
    process.join()


@contextmanager
def _environment(changes: Mapping[str, str]) -> Iterator[None]:
    """Change the environment of a starting process, which may load libraries before `_work`."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _work(pipe: "Pipe", call: bytes, environment: Mapping[str, str]) -> None:
    """Run a call in a new process, and send the outcome to the parent process."""
    # The parent process handles Ctrl-C, and terminates the new process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # SIGTERM raises KeyboardInterrupt, so that the job can save its work.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    threading.Thread(target=_exit_with_caller, daemon=True).start()
    try:
        pipe.send(run_call(call, environment))
    except KeyboardInterrupt:
        sys.exit(_TERMINATED)


def _exit_with_caller() -> None:
    caller = multiprocessing.parent_process()
    if caller is not None:
        wait([caller.sentinel])
        os._exit(1)
