"""Jobs in processes of this machine, a new one for each.

If a process is killed, only its own job is lost. No process outlives the one that started it.
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

from quarc_ref.jobs.job import Outcome, WorkerPool, attempt

if TYPE_CHECKING:
    Pipe = Connection[Outcome, Outcome]

_SPAWN = multiprocessing.get_context("spawn")  # threads of torch and numba do not survive a fork
_TERMINATED = 128 + signal.SIGTERM
_PATIENCE = 10.0  # seconds that a process has to end before it is killed


def run_in_processes(calls: Sequence[bytes], pool: WorkerPool) -> Iterator[tuple[int, Outcome]]:
    """Make calls, `pool.workers` at a time.

    Yields:
        The index of each call and its outcome, as they end.
    """
    running: dict[Pipe, tuple[int, BaseProcess]] = {}
    try:
        for place, call in enumerate(calls):
            if len(running) == pool.workers:
                yield from _take_ended(running)
            pipe, process = _start(call, pool)
            running[pipe] = (place, process)
        while running:
            yield from _take_ended(running)
    finally:
        for _, process in running.values():
            process.terminate()
        for _, process in running.values():
            _see_ended(process)


def _start(call: bytes, pool: WorkerPool) -> "tuple[Pipe, BaseProcess]":
    ours, theirs = _SPAWN.Pipe(duplex=False)
    process = _SPAWN.Process(target=_work, args=(theirs, call, pool.environment))
    with _environment(pool.environment):
        process.start()
    theirs.close()  # theirs alone is left, so that the pipe ends with the process
    return ours, process


def _take_ended(running: "dict[Pipe, tuple[int, BaseProcess]]") -> Iterator[tuple[int, Outcome]]:
    """Wait until a process ends; remove ended ones from `running`, and yield their outcomes."""
    for pipe in [pipe for pipe in running if pipe in wait(list(running))]:
        place, process = running.pop(pipe)
        try:
            outcome = pipe.recv()
        except EOFError:
            outcome = None
        _see_ended(process)
        yield (
            place,
            outcome or Outcome(fault=f"the process ended with exit code {process.exitcode}"),
        )


def _see_ended(process: BaseProcess) -> None:
    process.join(_PATIENCE)
    process.kill()
    process.join()


@contextmanager
def _environment(changes: Mapping[str, str]) -> Iterator[None]:
    """Change the environment for a process that starts: it may load libraries before `_work`."""
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
    """Make a call in this process and send its outcome."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the caller's, who ends this process
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a job may keep what it has done
    threading.Thread(target=_end_with_caller, daemon=True).start()
    try:
        pipe.send(attempt(call, environment))
    except KeyboardInterrupt:
        sys.exit(_TERMINATED)


def _end_with_caller() -> None:
    caller = multiprocessing.parent_process()
    if caller is not None:
        wait([caller.sentinel])
        os._exit(1)
