import gc
import threading
from itertools import count

import pytest

from quarc_ref.playback.prefetcher import Prefetcher


def test_items_come_in_order_from_another_thread():
    def make():
        for number in range(5):
            yield number, threading.get_ident()

    items = list(Prefetcher(make, 2))

    assert [number for number, _ in items] == list(range(5))
    assert threading.get_ident() not in {thread for _, thread in items}


def test_an_error_is_raised_after_all_items_before_it():
    def make():
        yield "first"
        message = "broken"
        raise OSError(message)

    ahead = Prefetcher(make, 4)

    assert next(ahead) == "first"
    with pytest.raises(OSError, match="broken"):
        next(ahead)
    with pytest.raises(StopIteration):
        next(ahead)


def test_no_more_items_are_made_than_the_queue_holds():
    made, asked = [], threading.Event()

    def make():
        for number in count():
            made.append(number)
            if number == 4:
                asked.set()
            yield number

    ahead = Prefetcher(make, 3)
    next(ahead)
    assert asked.wait(10)  # 0 was taken, 1 to 3 wait, 4 is held
    ahead.close()

    assert len(made) == 5


def test_closing_ends_the_iterator():
    closed = threading.Event()

    def make():
        try:
            yield from count()
        finally:
            closed.set()

    ahead = Prefetcher(make, 1)
    next(ahead)
    ahead.close()

    assert closed.is_set()
    assert list(ahead) == []


def test_closing_wakes_a_waiting_consumer():
    taken, let_go, items = threading.Event(), threading.Event(), []

    def make():
        yield 0
        let_go.wait(60)
        yield 1

    def take():
        for item in ahead:
            items.append(item)
            taken.set()

    ahead = Prefetcher(make, 1)
    taker = threading.Thread(target=take)
    taker.start()
    assert taken.wait(10)
    closer = threading.Thread(target=ahead.close)
    closer.start()
    let_go.set()
    closer.join(10)
    taker.join(10)

    assert not closer.is_alive()
    assert not taker.is_alive()
    assert items[:1] == [0]


def test_closing_does_not_wait_for_the_iterator():
    closed, waits = threading.Event(), threading.Event()

    def make():
        yield 0
        waits.set()
        assert closed.wait(60)

    ahead = Prefetcher(make, 1, closed=closed)
    next(ahead)
    assert waits.wait(10)
    ahead.close()

    assert closed.is_set()


def test_the_thread_of_a_dropped_prefetcher_ends():
    ended = threading.Event()

    def make():
        try:
            yield from count()
        finally:
            ended.set()

    ahead = Prefetcher(make, 1)
    next(ahead)
    del ahead
    gc.collect()

    assert ended.wait(10)


def test_an_unused_prefetcher_is_closed_without_starting():
    def make():
        pytest.fail("nobody asked")
        yield

    Prefetcher(make, 1).close()
