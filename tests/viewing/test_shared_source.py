import threading

from quarc_ref.viewing.shared_source import SharedSource


class Place:
    """A source that tells when two are in it at once."""

    def __init__(self):
        self.inside = 0
        self.crowded = False

    def read(self, offset, length):
        self.inside += 1
        self.crowded |= self.inside > 1
        data = bytes(offset + index for index in range(length))
        self.inside -= 1
        return data

    def size(self):
        return 7


def test_reads_are_those_of_the_source():
    shared = SharedSource(Place())

    assert shared.read(2, 3) == b"\2\3\4"
    assert shared.size() == 7


def test_one_reads_at_a_time():
    place = Place()
    shared = SharedSource(place)

    def read_often():
        for offset in range(200):
            assert shared.read(offset, 40)[:1] == bytes([offset])

    readers = [threading.Thread(target=read_often) for _ in range(4)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()

    assert not place.crowded
