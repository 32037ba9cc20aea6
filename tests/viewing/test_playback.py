import threading

import pytest

from quarc_ref.viewing.playback import Playback


class Clock:
    """A clock that is set by hand."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def playback(clock):
    return Playback(5, 8, 10.0, clock)


def _show(playback):
    frame = playback.await_frame(0)
    if frame is not None:
        playback.mark_shown(frame)
    return frame


def test_the_first_frame_is_shown_and_then_nothing_until_it_plays(playback, clock):
    shown = [_show(playback)]
    clock.now += 10
    shown.append(_show(playback))

    assert shown == [5, None]


def test_frames_come_at_their_pace_and_round_and_round(playback, clock):
    playback.play()
    shown = []
    for _ in range(17):
        shown.append(_show(playback))
        clock.now += 0.05

    assert [frame for frame in shown if frame is not None] == [5, 6, 7, 5, 6, 7, 5, 6, 7]


def test_a_frame_that_is_not_shown_is_asked_for_again(playback):
    assert [playback.await_frame(0) for _ in range(3)] == [5, 5, 5]


@pytest.mark.parametrize(("speed", "count"), [(0.5, 6), (1, 11), (2, 21)])
def test_speed_is_how_much_faster_frames_come(speed, count, playback, clock):
    playback.set_speed(speed)
    playback.play()
    shown = 0
    for _ in range(1001):
        shown += _show(playback) is not None
        clock.now += 0.001

    assert abs(shown - count) <= 1


def test_time_that_was_lost_is_not_made_up_for(playback, clock):
    playback.play()
    _show(playback)
    clock.now += 50
    late = _show(playback)

    assert late == 6
    assert _show(playback) == 7
    assert _show(playback) is None


def test_a_pause_holds_the_frame(playback, clock):
    playback.play()
    _show(playback)
    playback.play(on=False)
    clock.now += 1

    assert not playback.is_playing
    assert _show(playback) is None


@pytest.mark.parametrize("playing", [False, True])
def test_a_jump_is_shown_at_once(playing, playback):
    playback.play(on=playing)
    _show(playback)
    playback.seek(7)

    assert _show(playback) == 7


def test_a_jump_while_a_frame_is_got_makes_that_frame_late(playback):
    frame = playback.await_frame(0)
    playback.seek(7)
    playback.mark_shown(frame)

    assert playback.await_frame(0) == 7


def test_who_waits_is_woken_by_a_jump():
    playback, shown = Playback(0, 9, 10.0), []
    playback.mark_shown(playback.await_frame(0))
    waiter = threading.Thread(target=lambda: shown.append(playback.await_frame(60)))
    waiter.start()
    playback.seek(3)
    waiter.join(30)

    assert shown == [3]
