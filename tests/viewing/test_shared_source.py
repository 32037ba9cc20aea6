import threading
import time
from contextlib import suppress

from quarc_ref.viewing.shared_source import GrowingSource, SharedSource


class MeetingSource:
    """A source in which every read waits briefly for a concurrent read."""

    def __init__(self):
        self.had_concurrent_reads = False
        self._meeting = threading.Barrier(2)

    def read(self, offset, length):
        with suppress(threading.BrokenBarrierError):
            self._meeting.wait(0.5)
            self.had_concurrent_reads = True
        return bytes(offset + index for index in range(length))

    def size(self):
        return 7


def test_reads_are_those_of_the_source():
    shared_source = SharedSource(MeetingSource())

    assert shared_source.read(2, 3) == b"\2\3\4"
    assert shared_source.size() == 7


def test_only_one_thread_reads_at_a_time():
    source = MeetingSource()
    shared_source = SharedSource(source)

    readers = [threading.Thread(target=shared_source.read, args=(0, 4)) for _ in range(4)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()

    assert not source.had_concurrent_reads


class GrowingBytes:
    """A source that grows by one byte at each call of `size`."""

    def __init__(self, max_size):
        self._bytes, self._max_size = 0, max_size

    def size(self):
        self._bytes = min(self._bytes + 1, self._max_size)
        return self._bytes


def test_a_read_waits_for_bytes_that_are_still_to_come(monkeypatch):
    monkeypatch.setattr("quarc_ref.viewing.shared_source._POLL_SECONDS", 0.01)
    growing = GrowingSource(GrowingBytes(max_size=5), max_wait_seconds=60)
    growing.wait_for_data(3)

    assert growing.size() == 5


def test_a_read_waits_at_most_until_its_timeout():
    start_time = time.monotonic()
    GrowingSource(GrowingBytes(max_size=3), max_wait_seconds=0.05).wait_for_data(3)

    assert 0.05 <= time.monotonic() - start_time < 30
