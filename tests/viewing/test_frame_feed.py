import threading
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.viewing.frame_feed import FrameFeed

STOP = 30
CANONICAL = (4, 10, 25)
SIZE = 100


@dataclass(frozen=True)
class Frame:
    """A frame of a size that differs a little from the others'."""

    frame: int
    nbytes: int


class Stream:
    """Frames 4 to 29, of which some are canonical and one may be damaged."""

    def __init__(self, damaged=None):
        self.damaged = damaged
        self.starts = []
        self.decoded = []

    def play(self, start):
        self.starts.append(start)
        for frame in range(start, STOP):
            if frame == self.damaged:
                message = "damaged"
                raise OSError(message)
            self.decoded.append(frame)
            yield SimpleNamespace(frame=frame)

    def feed(self, most=1 << 20):
        return FrameFeed(self.play, CANONICAL, STOP, self.prepare, most)

    @staticmethod
    def prepare(scene):
        return Frame(scene.frame, SIZE - scene.frame % 3)


def _get(feed, frame):
    ready = feed.get(frame, 60)
    assert ready is not None
    return ready.frame


def test_frames_are_given_in_any_order():
    with Stream().feed() as feed:
        assert [_get(feed, frame) for frame in (4, 5, 28, 6, 12, 29, 4)] == [4, 5, 28, 6, 12, 29, 4]


def test_what_fits_is_decoded_once():
    stream = Stream()
    with stream.feed() as feed:
        for _ in range(3):
            assert [_get(feed, frame) for frame in range(4, STOP)] == list(range(4, STOP))

    assert sorted(stream.decoded) == list(range(4, STOP))


def test_what_follows_is_decoded_before_it_is_asked_for():
    stream = Stream()
    with stream.feed(10 * SIZE) as feed:
        _get(feed, 13)
        while 22 not in stream.decoded:
            feed.get(13, 0.01)

        assert all(feed.get(frame, 0) is not None for frame in range(13, 22))


@given(st.lists(st.integers(4, STOP - 1), min_size=1, max_size=12), st.integers(0, 12))
def test_memory_is_bounded_whatever_is_asked_for(frames, most):
    with Stream().feed(most * SIZE) as feed:
        for frame in frames:
            assert _get(feed, frame) == frame
            count, size = feed.count_kept()
            assert size <= max(2, most + 1) * SIZE
            assert count <= max(2, most + 1)


def test_playing_round_and_round_in_little_memory_decodes_no_frame_twice_a_round():
    stream = Stream()
    with stream.feed(5 * SIZE) as feed:
        for _ in range(3):
            for frame in range(4, STOP):
                _get(feed, frame)

    assert len(stream.decoded) <= 4 * (STOP - 4)
    assert set(stream.starts) == {4}


def test_a_frame_is_sought_from_the_canonical_one_before_it():
    stream = Stream()
    with stream.feed(2 * SIZE) as feed:
        _get(feed, 27)
        assert 25 in stream.starts
        assert 10 not in stream.starts
        _get(feed, 12)
        assert 10 in stream.starts


def test_a_fault_is_told_where_it_is_and_spares_what_is_before():
    with Stream(damaged=15).feed() as feed:
        with pytest.raises(OSError, match="damaged"):
            feed.get(20, 60)
        assert _get(feed, 14) == 14
        with pytest.raises(OSError, match="damaged"):
            feed.get(15, 60)


def test_a_fault_ahead_keeps_no_frame_from_being_shown():
    with Stream(damaged=15).feed() as feed:
        assert [_get(feed, frame) for frame in range(4, 15)] == list(range(4, 15))


def test_no_thread_stays_behind():
    before = threading.active_count()
    with Stream().feed() as feed:
        feed.get(4, 60)

    assert threading.active_count() == before
