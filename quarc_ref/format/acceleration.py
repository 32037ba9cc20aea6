"""Whether compiled kernels are used, and how many threads: the one place that chooses.

What a kernel computes, plain NumPy computes too: nothing but time hangs on the
choice. numba is imported when a scene is first met that is large enough for it
to pay, or never, where it is not installed; what has been loaded once is used
from then on. `QUARC_REF_KERNELS` says otherwise: `plain` or `compiled`.
`QUARC_REF_THREADS` is the number of threads; a frame that moves few Gaussians
takes one.
"""

import gc
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache
from importlib import import_module
from threading import Lock
from types import ModuleType
from typing import Final, Generic, TypeVar

from quarc_ref.format.errors import VariableError

PLAIN: Final = "plain"
COMPILED: Final = "compiled"
_WORTH_LOADING: Final = 1 << 13
_WORTH_SHARING: Final = 50_000  # below, threads wait for each other longer than they help

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

    Raises:
        VariableError: QUARC_REF_KERNELS names no kernels.
    """
    chosen = _kernels.get() or os.environ.get("QUARC_REF_KERNELS")
    pays = elements >= _WORTH_LOADING or module in sys.modules
    wanted = _is_compiled(chosen) if chosen else pays
    return _import(module) if wanted else None


def lacks_kernels() -> bool:
    """Tell whether compiled kernels were wanted, in this process so far, and cannot be loaded."""
    return bool(_not_loaded)


@contextmanager
def computing_with(kernels: str) -> Iterator[None]:
    """Use `PLAIN` or `COMPILED` kernels, as long as this context lasts."""
    token = _kernels.set(kernels)
    try:
        yield
    finally:
        _kernels.reset(token)


def count_threads() -> int:
    """Return how many threads one piece of work may take.

    Raises:
        VariableError: QUARC_REF_THREADS is no number of threads.
    """
    return _threads.get() or _parse_threads(os.environ.get("QUARC_REF_THREADS") or "1")


@contextmanager
def threading_by(count: int) -> Iterator[None]:
    """Let a piece of work take so many threads, at least 1, as long as this context lasts."""
    token = _threads.set(count)
    try:
        yield
    finally:
        _threads.reset(token)


@contextmanager
def threading_for(elements: int) -> Iterator[None]:
    """Take no more than one thread, as long as this context lasts, if there is little to do.

    Args:
        elements: How many Gaussians there are to work on.
    """
    if elements >= _WORTH_SHARING:
        yield
        return
    with threading_by(1):
        yield


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
    tasks = [_Task(action, part) for part in parts]
    others = count_threads() - 1
    for _ in range(min(others, len(tasks))):
        _pool(others).submit(copy_context().run, _do, tasks)
    if others == 0:
        _do(tasks)
    context = copy_context()

    def wait() -> list[_Answer]:
        context.copy().run(_do, tasks[::-1])
        return [task.answer() for task in tasks]

    return wait


class _Task(Generic[_Part, _Answer]):
    """A part that is done once, by the first thread that comes to it, and then let go."""

    def __init__(self, action: Callable[[_Part], _Answer], part: _Part) -> None:
        self._work = (action, part)
        self._begun, self._doing = Lock(), Lock()
        self._doing.acquire()
        self._error: BaseException | None = None

    def do(self) -> None:
        """Do it, unless somebody has begun with it."""
        if not self._begun.acquire(blocking=False):
            return
        try:
            action, part = self._work
            del self._work
            self._answer = action(part)
        except Exception as error:
            self._error = error
        except BaseException as error:  # an interruption is not put off until somebody waits
            self._error = error
            raise
        finally:
            self._doing.release()

    def answer(self) -> _Answer:
        """Wait until it is done; return what came of it, or raise what went wrong."""
        with self._doing:
            if self._error is not None:
                raise self._error
            return self._answer


def _do(tasks: Sequence[_Task[_Part, _Answer]]) -> None:
    """Do tasks in one thread: one that waited for others might wait for itself."""
    with threading_by(1):
        for task in tasks:
            task.do()


def _is_compiled(kernels: str) -> bool:
    if kernels not in (PLAIN, COMPILED):
        message = f"QUARC_REF_KERNELS is {kernels!r}; it may be {PLAIN} or {COMPILED}"
        raise VariableError(message)
    return kernels == COMPILED


def _parse_threads(number: str) -> int:
    if not (number.isascii() and number.isdigit() and int(number) > 0):
        message = f"QUARC_REF_THREADS is {number!r}; it may be a whole number from 1 on"
        raise VariableError(message)
    return int(number)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="quarc-ref")


@cache
def _import(module: str) -> ModuleType | None:
    try:
        with _keeping_all():
            return import_module(module)
    except ImportError:  # numba is not installed, or not for this NumPy
        _not_loaded.add(module)
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


_not_loaded: set[str] = set()
_kernels: ContextVar[str | None] = ContextVar("kernels", default=None)
_threads: ContextVar[int | None] = ContextVar("threads", default=None)
