import itertools
from types import SimpleNamespace

import pytest

from quarc_ref.format.errors import TruncatedError
from quarc_ref.streams import follow
from quarc_ref.streams.follow import Follow, poll


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """A clock that advances by a second whenever it is read."""
    seconds = itertools.count()
    time = SimpleNamespace(monotonic=lambda: next(seconds), sleep=lambda _: None)
    monkeypatch.setattr(follow, "time", time)


def _make_action(offsets):
    """Return a function that fails at each of the offsets, and then returns a result."""
    remaining = iter(offsets)

    def read():
        for offset in remaining:
            message = "the stream ends"
            raise TruncatedError(message, offset)
        return "result"

    return read


def test_waiting_starts_again_whenever_the_stream_has_grown():
    offsets = [offset for offset in range(20) for _ in range(4)]

    assert poll(_make_action(offsets), Follow(interval=0, patience=4)) == "result"


@pytest.mark.parametrize("offsets", [[7] * 6, [7, 3, 5, 6, 7, 3], [None] * 6])
def test_waiting_ends_if_the_stream_does_not_grow(offsets):
    with pytest.raises(TruncatedError, match="the stream ends; no new data for 4 s"):
        poll(_make_action(offsets), Follow(interval=0, patience=4))
    assert poll(_make_action(offsets[:4]), Follow(interval=0, patience=4)) == "result"


def test_a_stream_that_is_not_followed_is_read_once():
    with pytest.raises(TruncatedError, match=r"the stream ends$"):
        poll(_make_action([7]), None)
