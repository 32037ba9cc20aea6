import threading
from contextlib import suppress

from quarc_ref.viewing.shared_source import SharedSource


class Place:
    """A source in which readers wait a little for each other."""

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


def test_one_reads_at_a_time():
    place = Place()
    shared = SharedSource(place)

    readers = [threading.Thread(target=shared.read, args=(0, 4)) for _ in range(4)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()

    assert not place.crowded
