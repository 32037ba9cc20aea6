import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.constants import COUNTER_LIMIT
from quarc_ref.format.frame_rate import MAX_FRAME_RATE, MIN_FRAME_RATE, is_frame_rate, to_clock


@given(st.floats(MIN_FRAME_RATE, MAX_FRAME_RATE))
def test_every_frame_rate_has_a_clock_that_a_header_can_store(frames_per_second):
    timescale, frame_ticks = to_clock(frames_per_second)

    assert is_frame_rate(frames_per_second)
    assert 1 <= timescale <= COUNTER_LIMIT
    assert 1 <= frame_ticks <= COUNTER_LIMIT


@pytest.mark.parametrize(
    ("frames_per_second", "clock"),
    [(30, (30, 1)), (29.97002997, (30000, 1001)), (0.5, (1, 2)), (23.976, (2997, 125))],
)
def test_common_frame_rates_are_exact(frames_per_second, clock):
    assert to_clock(frames_per_second) == clock


@pytest.mark.parametrize("number", [0, -30, 1e-4, 2e6, math.nan, math.inf])
def test_other_numbers_are_no_frame_rates(number):
    assert not is_frame_rate(number)


@pytest.mark.parametrize("frames_per_second", [0, -1, 1e9, float("nan"), float("inf")])
def test_a_frame_rate_that_no_header_can_store_is_named(frames_per_second):
    with pytest.raises(ValueError, match=r"frame rate is .* must be from 0\.001 to"):
        to_clock(frames_per_second)
