"""Runs an iterator in a background thread, with a limited number of items in advance."""

import weakref
from collections.abc import Callable, Generator
from contextlib import closing, suppress
from contextvars import copy_context
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Generic, TypeVar

_Item = TypeVar("_Item")
_POLL_SECONDS = 0.1


class Prefetcher(Generic[_Item]):
    """Yields the items of an iterator, then raises the exception that ended it, if any.

    The thread starts when the first item is requested, in a copy of the caller's context, and ends
    when the prefetcher is closed or garbage-collected.

    Args:
        make_iterator: Function that makes the iterator; the thread calls it, then runs the
            iterator.
        max_items: Maximum number of buffered items.
        closed: Event that `close` sets to make the iterator stop waiting; None if the iterator
            does not wait.
    """

    def __init__(
        self,
        make_iterator: Callable[[], Generator[_Item]],
        max_items: int,
        *,
        closed: Event | None = None,
    ) -> None:
        self._worker = _Worker(make_iterator, max_items, closed or Event())
        self._thread = Thread(target=copy_context().run, args=(self._worker.run,), daemon=True)
        self._is_finished = False
        # The thread must not refer to this object, which could otherwise not be garbage-collected.
        weakref.finalize(self, self._worker.end)

    def __iter__(self) -> "Prefetcher[_Item]":
        return self

    def __next__(self) -> _Item:
        if self._is_finished or self._worker.closed.is_set():
            raise StopIteration
        if self._thread.ident is None:
            self._thread.start()
        item, error = self._worker.queue.get()
        if item is not None:
            return item
        self._is_finished = True
        if error is not None:
            raise error
        raise StopIteration

    def close(self) -> None:
        """End the thread and wait for it."""
        self._worker.end()
        while self._thread.is_alive():
            self._worker.drain()
            self._thread.join(_POLL_SECONDS)
        self._worker.drain()
        self._worker.wake()


class _Worker(Generic[_Item]):
    """Fills the buffer of a `Prefetcher` from a thread; holds the data that both threads use."""

    def __init__(
        self, make_iterator: Callable[[], Generator[_Item]], max_items: int, closed: Event
    ) -> None:
        self._make_iterator = make_iterator
        self.queue: Queue[tuple[_Item | None, BaseException | None]] = Queue(max_items)
        self.closed = closed

    def run(self) -> None:
        """Put all items into the buffer, then a marker of the iterator's end, or its exception."""
        error = None
        try:
            self._produce_all()
        except BaseException as raised:
            error = raised
        if not self._put(None, error):
            self.wake()

    def end(self) -> None:
        """Stop producing items."""
        self.closed.set()

    def wake(self) -> None:
        """Wake a consumer that waits for an item."""
        with suppress(Full):  # the consumer is not blocked
            self.queue.put_nowait((None, None))

    def drain(self) -> None:
        """Discard the buffered items."""
        with suppress(Empty):
            while True:
                self.queue.get_nowait()

    def _produce_all(self) -> None:
        with closing(self._make_iterator()) as items:
            for item in items:
                if not self._put(item, None):
                    return

    def _put(self, item: _Item | None, error: BaseException | None) -> bool:
        """Add an item when the buffer has space; return False if the prefetcher is closed."""
        while not self.closed.is_set():
            try:
                self.queue.put((item, error), timeout=_POLL_SECONDS)
            except Full:
                continue
            return not self.closed.is_set()
        return False
