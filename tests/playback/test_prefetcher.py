import gc
import threading
from itertools import count

import pytest

from quarc_ref.playback.prefetcher import Prefetcher


def test_items_come_in_order_and_from_another_thread():
    def make():
        for number in range(5):
            yield number, threading.get_ident()

    items = list(Prefetcher(make, 2))

    assert [number for number, _ in items] == list(range(5))
    assert threading.get_ident() not in {thread for _, thread in items}


def test_a_fault_comes_after_all_items_before_it():
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


def test_no_more_are_made_than_may_wait():
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


def test_what_is_closed_ends_its_iterator_and_gives_no_more():
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


def test_whoever_waits_for_an_item_is_told_when_it_is_closed():
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


def test_an_iterator_need_not_wait_when_it_is_closed():
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


def test_the_thread_of_what_is_let_go_ends():
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


def test_what_was_never_asked_for_is_closed_without_beginning():
    def make():
        pytest.fail("nobody asked")
        yield

    Prefetcher(make, 1).close()
