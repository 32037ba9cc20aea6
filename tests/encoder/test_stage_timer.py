import io

import pytest

from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.stage_timer import StageTimer
from tests.encoder.toys import SMALL, make_capture

_STAGES = ["canonical", "canonical commit", "anchors", "motion", "placement", "births", "commit"]


class _ManualClock:
    """A clock whose time the test sets."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_seconds_between_two_stages_count_for_the_next():
    clock = _ManualClock()
    timer = StageTimer(clock=clock)
    steps = [
        (5, "canonical"), (2, "canonical"), (1, "frames"), (3, "motion"), (4, "motion"),
        (7, "births"), (8, "births"), (9, "frames"), (10, "motion"), (11, "frames"),
    ]  # fmt: skip
    for seconds, stage in steps:
        clock.now += seconds
        timer.advance(stage, 1, 1)

    assert timer.seconds == {
        "canonical": 7, "canonical commit": 1, "anchors": 13, "motion": 4, "placement": 7,
        "births": 8, "commit": 20,
    }  # fmt: skip


def test_seconds_of_another_timer_are_excluded():
    clock, reported = _ManualClock(), []

    class SlowProgress:
        def advance(self, *step):
            reported.append(step)
            clock.now += 100

    timer = StageTimer(SlowProgress(), clock)
    clock.now += 1
    timer.advance("motion", 1, 2)
    clock.now += 2
    timer.advance("motion", 2, 2)

    assert timer.seconds == {"motion": 3}
    assert reported == [("motion", 1, 2), ("motion", 2, 2)]


def test_time_of_other_work_in_between_is_excluded():
    clock = _ManualClock()
    timer = StageTimer(clock=clock)
    clock.now += 1
    timer.advance("frames", 1, 2)
    clock.now += 50
    timer.skip()
    clock.now += 2
    timer.advance("motion", 1, 1)

    assert timer.seconds == {"frames": 1, "anchors": 2}


def test_an_encode_times_all_stages_and_no_others():
    timer = StageTimer()
    start_time = timer._clock()
    encode(make_capture(2), io.BytesIO(), EncodeOptions(SMALL, device="cpu", progress=timer))

    assert sorted(timer.seconds) == sorted(_STAGES)
    assert 0 < sum(timer.seconds.values()) == pytest.approx(timer._clock() - start_time, rel=0.1)
