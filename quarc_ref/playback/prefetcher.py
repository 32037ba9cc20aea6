"""Runs an iterator in a background thread, with a limited number of items in advance."""

import weakref
from collections.abc import Callable, Generator
from contextlib import closing, suppress
from contextvars import copy_context
from queue import Empty, SimpleQueue
from threading import Event, Semaphore, Thread
from typing import Generic, TypeVar

_Item = TypeVar("_Item")


class Prefetcher(Generic[_Item]):
    """Yields the items of an iterator, then raises the exception that ended it, if any.

    The thread starts when the first item is requested, in a copy of the caller's context, and ends
    when the prefetcher is closed or garbage-collected.

    Args:
        make_iterator: Function that makes the iterator; the thread calls it, then runs the
            iterator.
        max_items: Maximum number of items in advance, including the one that is being made.
    """

    def __init__(self, make_iterator: Callable[[], Generator[_Item]], max_items: int) -> None:
        self._worker = _Worker(make_iterator, max_items)
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
        item, error = self._worker.take()
        if item is not None:
            return item
        self._is_finished = True
        if error is not None:
            raise error
        raise StopIteration

    def close(self) -> None:
        """End the thread and wait for it."""
        self._worker.end()
        if self._thread.ident is not None:
            self._thread.join()
        self._worker.discard_items()


class _Worker(Generic[_Item]):
    """Makes the items of a `Prefetcher` in a thread; holds the data that both threads use."""

    def __init__(self, make_iterator: Callable[[], Generator[_Item]], max_items: int) -> None:
        self._make_iterator = make_iterator
        self._items: SimpleQueue[tuple[_Item | None, BaseException | None]] = SimpleQueue()
        self._room = Semaphore(max_items)
        self.closed = Event()

    def run(self) -> None:
        """Make all items, then a marker of the iterator's end, or the exception that ended it."""
        error = None
        try:
            self._make_all()
        except BaseException as raised:
            error = raised
        self._items.put((None, error))

    def take(self) -> tuple[_Item | None, BaseException | None]:
        """Wait for the next item, or for the marker; the thread may then make another item."""
        taken = self._items.get()
        self._room.release()
        return taken

    def end(self) -> None:
        """Make no further items."""
        self.closed.set()
        self._room.release()  # wakes the thread if it waits

    def discard_items(self) -> None:
        """Discard the items that were not taken, and wake a thread that waits for one."""
        with suppress(Empty):
            while True:
                self._items.get_nowait()
        self._items.put((None, None))

    def _make_all(self) -> None:
        with closing(self._make_iterator()) as items:
            while True:
                self._room.acquire()
                if self.closed.is_set():
                    return
                try:
                    item = next(items)
                except StopIteration:
                    return
                self._items.put((item, None))
                del item  # it belongs to whoever takes it
