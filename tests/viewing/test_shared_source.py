import threading
import time
from contextlib import suppress

from quarc_ref.viewing.shared_source import GrowingSource, SharedSource


class Place:
    """A source in which readers briefly wait for each other."""

    def __init__(self):
        self.crowded = False
        self._meeting = threading.Barrier(2)

    def read(self, offset, length):
        with suppress(threading.BrokenBarrierError):
            self._meeting.wait(0.5)
            self.crowded = True
        return bytes(offset + index for index in range(length))

    def size(self):
        return 7


def test_reads_are_those_of_the_source():
    shared = SharedSource(Place())

    assert shared.read(2, 3) == b"\2\3\4"
    assert shared.size() == 7


def test_only_one_thread_reads_at_a_time():
    place = Place()
    shared = SharedSource(place)

    readers = [threading.Thread(target=shared.read, args=(0, 4)) for _ in range(4)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()

    assert not place.crowded


class Growing:
    """A source that gains a byte at each read."""

    def __init__(self, most):
        self._bytes, self._most = 0, most

    def size(self):
        self._bytes = min(self._bytes + 1, self._most)
        return self._bytes


def test_a_read_waits_for_bytes_that_are_still_to_come(monkeypatch):
    monkeypatch.setattr("quarc_ref.viewing.shared_source._POLL_SECONDS", 0.01)
    growing = GrowingSource(Growing(most=5), patience=60)
    growing.wait_for_data(3)

    assert growing.size() == 5


def test_a_read_waits_at_most_until_its_timeout():
    started = time.monotonic()
    GrowingSource(Growing(most=3), patience=0.05).wait_for_data(3)

    assert 0.05 <= time.monotonic() - started < 30
