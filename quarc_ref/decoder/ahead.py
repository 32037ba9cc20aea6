"""An iterator that runs in a thread of its own, a bounded number of items ahead."""

from collections.abc import Callable, Generator
from contextlib import closing
from contextvars import copy_context
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Generic, TypeVar

_Item = TypeVar("_Item")
_LOOK_AGAIN = 0.1


class Ahead(Generic[_Item]):
    """Yields what an iterator yields, and raises what it raises, after all before it.

    The thread begins with the first item that is asked for, in a copy of the
    maker's context.

    Args:
        make: Makes the iterator, in the thread; it is closed there, too.
        most: How many items may wait to be taken.
        first_alone: Whether the second item is not begun before it is asked for, so that
            whoever works on the first has the processor.
    """

    def __init__(
        self, make: Callable[[], Generator[_Item]], most: int, *, first_alone: bool = False
    ) -> None:
        self._make = make
        self._queue: Queue[tuple[_Item | None, BaseException | None]] = Queue(most)
        self._is_closed = Event()
        self._may_go_on = Event()
        if not first_alone:
            self._may_go_on.set()
        self._thread = Thread(target=copy_context().run, args=(self._run,), daemon=True)
        self._is_over = False

    def __iter__(self) -> "Ahead[_Item]":
        return self

    def __next__(self) -> _Item:
        if self._is_over or self._is_closed.is_set():
            raise StopIteration
        if self._thread.ident is None:
            self._thread.start()
        else:
            self._may_go_on.set()
        item, error = self._queue.get()
        if item is not None:
            return item
        self._is_over = True
        if error is not None:
            raise error
        raise StopIteration

    def close(self) -> None:
        """End the thread, and wait until it has ended."""
        self._is_closed.set()
        self._may_go_on.set()
        if self._thread.ident is None:
            return
        while self._thread.is_alive():
            self._drain()
            self._thread.join(_LOOK_AGAIN)
        self._drain()

    def _drain(self) -> None:
        try:
            while True:
                self._queue.get_nowait()
        except Empty:
            return

    def _run(self) -> None:
        error = None
        try:
            with closing(self._make()) as items:
                for item in items:
                    if not self._hand_over(item, None):
                        return
                    self._may_go_on.wait()
        except BaseException as raised:
            error = raised
        self._hand_over(None, error)

    def _hand_over(self, item: _Item | None, error: BaseException | None) -> bool:
        """Wait for room; return whether anybody still wants it."""
        while not self._is_closed.is_set():
            try:
                self._queue.put((item, error), timeout=_LOOK_AGAIN)
            except Full:
                continue
            return not self._is_closed.is_set()
        return False
