"""Whether compiled kernels are used, and how many threads: the one place that chooses.

What a kernel computes, plain NumPy computes too: nothing but time hangs on the
choice. numba is imported when a scene is first met that is large enough for it
to pay, or never, where it is not installed; what has been loaded once is used
from then on. `QUARC_REF_KERNELS` says otherwise: `plain` or `compiled`.
`QUARC_REF_THREADS` is the number of threads.
"""

import gc
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache, partial
from importlib import import_module
from threading import Lock
from types import ModuleType
from typing import Final, Generic, TypeVar

PLAIN: Final = "plain"
COMPILED: Final = "compiled"
_WORTH_LOADING: Final = 1 << 13

_Part = TypeVar("_Part")
_Answer = TypeVar("_Answer")

# Returns when what other threads do is done.
Wait = Callable[[], object]


def settled() -> None:
    """Wait for nothing."""


def load_kernels(module: str, elements: int) -> ModuleType | None:
    """Return a module of kernels; None where plain NumPy is to do the work.

    Args:
        module: Its full name.
        elements: How many Gaussians, anchors or bits there are to work on.
    """
    chosen = _kernels.get() or os.environ.get("QUARC_REF_KERNELS")
    wanted = chosen == COMPILED
    if chosen is None:
        wanted = elements >= _WORTH_LOADING or module in sys.modules
    return _import(module) if wanted else None


@contextmanager
def computing_with(kernels: str) -> Iterator[None]:
    """Use `PLAIN` or `COMPILED` kernels, as long as this context lasts."""
    token = _kernels.set(kernels)
    try:
        yield
    finally:
        _kernels.reset(token)


def count_threads() -> int:
    """Return how many threads one piece of work may take."""
    return _threads.get() or int(os.environ.get("QUARC_REF_THREADS", "1"))


@contextmanager
def threading_by(count: int) -> Iterator[None]:
    """Let a piece of work take so many threads, as long as this context lasts."""
    token = _threads.set(count)
    try:
        yield
    finally:
        _threads.reset(token)


def map_parts(action: Callable[[_Part], _Answer], parts: Sequence[_Part]) -> list[_Answer]:
    """Return what an action makes of each part, in order, by as many threads as there may be."""
    if len(parts) == 1:
        return [action(parts[0])]
    return start_parts(action, parts)()


def start_parts(
    action: Callable[[_Part], _Answer], parts: Sequence[_Part]
) -> Callable[[], list[_Answer]]:
    """Do as `map_parts`, and where there may be threads do not wait.

    Returns:
        What waits, and returns the answers or raises what went wrong first of
        them; it may be called again. Whoever waits lends a hand: the last part
        that nobody has begun is the next.
    """
    threads = count_threads()
    tasks = [_Task(partial(copy_context().run, _alone, action, part)) for part in parts]
    for task in tasks:
        if threads > 1:
            _pool(threads - 1).submit(task.do)
        else:
            task.do()

    def wait() -> list[_Answer]:
        for task in reversed(tasks):
            task.do()
        return [task.outcome.result() for task in tasks]

    return wait


class _Task(Generic[_Answer]):
    """Something that is done once, by the first thread that comes to it, and then let go."""

    def __init__(self, action: Callable[[], _Answer]) -> None:
        self._action = action
        self._begun = Lock()
        self.outcome: Future[_Answer] = Future()

    def do(self) -> None:
        """Do it, unless somebody has begun with it."""
        if not self._begun.acquire(blocking=False):
            return
        action = self._action
        del self._action
        try:
            self.outcome.set_result(action())
        except BaseException as error:
            self.outcome.set_exception(error)


def _alone(action: Callable[[_Part], _Answer], part: _Part) -> _Answer:
    """Act in one thread: one that waited for others might wait for itself."""
    with threading_by(1):
        return action(part)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="quarc-ref")


@cache
def _import(module: str) -> ModuleType | None:
    try:
        with _keeping_all():
            return import_module(module)
    except ImportError:  # numba is not installed, or not for this NumPy
        return None


@contextmanager
def _keeping_all() -> Iterator[None]:
    """Look for no garbage: what numba loads stays, and is looked through again and again."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


_kernels: ContextVar[str | None] = ContextVar("kernels", default=None)
_threads: ContextVar[int | None] = ContextVar("threads", default=None)
