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

    prefetcher = Prefetcher(make, 4)

    assert next(prefetcher) == "first"
    with pytest.raises(OSError, match="broken"):
        next(prefetcher)
    with pytest.raises(StopIteration):
        next(prefetcher)


def test_no_more_items_are_made_than_requested():
    made_items, is_fourth_made, is_fifth_made = [], threading.Event(), threading.Event()

    def make():
        for number in count():
            made_items.append(number)
            {3: is_fourth_made, 4: is_fifth_made}.get(number, threading.Event()).set()
            yield number

    prefetcher = Prefetcher(make, 3)
    next(prefetcher)
    assert is_fourth_made.wait(10)  # 0 was taken, 1 to 3 are in advance
    assert not is_fifth_made.wait(0.2)
    prefetcher.close()

    assert made_items == [0, 1, 2, 3]


def test_closing_ends_the_iterator():
    closed = threading.Event()

    def make():
        try:
            yield from count()
        finally:
            closed.set()

    prefetcher = Prefetcher(make, 1)
    next(prefetcher)
    prefetcher.close()

    assert closed.is_set()
    assert list(prefetcher) == []


def test_closing_wakes_a_waiting_consumer():
    is_first_taken, may_continue, items = threading.Event(), threading.Event(), []

    def make():
        yield 0
        may_continue.wait(60)
        yield 1

    def consume():
        for item in prefetcher:
            items.append(item)
            is_first_taken.set()

    prefetcher = Prefetcher(make, 1)
    consumer = threading.Thread(target=consume)
    consumer.start()
    assert is_first_taken.wait(10)
    closer = threading.Thread(target=prefetcher.close)
    closer.start()
    may_continue.set()
    closer.join(10)
    consumer.join(10)

    assert not closer.is_alive()
    assert not consumer.is_alive()
    assert items[:1] == [0]


def test_the_thread_of_a_dropped_prefetcher_ends():
    ended = threading.Event()

    def make():
        try:
            yield from count()
        finally:
            ended.set()

    prefetcher = Prefetcher(make, 1)
    next(prefetcher)
    del prefetcher
    gc.collect()

    assert ended.wait(10)


def test_an_unused_prefetcher_is_closed_without_starting():
    def make():
        pytest.fail("the iterator was started")
        yield

    Prefetcher(make, 1).close()
