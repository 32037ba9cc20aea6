import pytest

from quarc_ref.encoder.monitoring.forecast import (
    HALF_RESOLUTION_COST,
    TimeForecast,
    estimate_frame_seconds,
)
from quarc_ref.encoder.monitoring.monitor import EncodePlan
from quarc_ref.encoder.monitoring.status import format_duration


class _Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return _Clock()


def _make_plan(first_frame=0, half_resolution_steps=0):
    return EncodePlan("room", 11, first_frame, 0, 10, 100, half_resolution_steps, 50, 20)


def test_there_is_no_forecast_before_the_first_measurement(clock):
    forecast = TimeForecast(_make_plan(), clock)
    assert forecast.seconds_left() is None
    forecast.record_step("canonical", 1)
    assert forecast.seconds_left() is None


def test_frame_0_gives_a_forecast_for_all_frames(clock):
    forecast = TimeForecast(_make_plan(), clock)
    for step in range(1, 41):
        clock.now += 0.5
        forecast.record_step("canonical", step)

    remaining_seconds = 10 * estimate_frame_seconds(_make_plan(), 0.5)
    assert forecast.seconds_left() == pytest.approx(60 * 0.5 + remaining_seconds)
    clock.now += 1
    forecast.record_frame(0)
    assert forecast.seconds_left() == pytest.approx(remaining_seconds)


@pytest.mark.parametrize("step", [40, 75, 100])
def test_steps_at_half_resolution_count_less(clock, step):
    plan = _make_plan(half_resolution_steps=70)
    forecast = TimeForecast(plan, clock)
    for index in range(1, step + 1):
        clock.now += 0.5 * HALF_RESOLUTION_COST if index <= 70 else 0.5
        forecast.record_step("canonical", index)

    half_steps_left, full_steps_left = max(0, 70 - step), min(30, 100 - step)
    remaining_steps = half_steps_left * HALF_RESOLUTION_COST + full_steps_left
    remaining_seconds = 10 * estimate_frame_seconds(plan, 0.5)
    assert forecast.seconds_left() == pytest.approx(remaining_steps * 0.5 + remaining_seconds)


def test_later_frames_improve_the_forecast(clock):
    forecast = TimeForecast(_make_plan(), clock)
    forecast.record_frame(0)
    for frame in range(1, 5):
        clock.now += 3
        forecast.record_frame(frame)

    assert forecast.seconds_left() == 6 * 3
    clock.now += 2
    assert forecast.seconds_left() == 6 * 3 - 2
    for frame in range(5, 11):
        forecast.record_frame(frame)
    assert forecast.seconds_left() == 0


def test_a_resumed_encode_forecasts_the_remaining_time(clock):
    forecast = TimeForecast(_make_plan(first_frame=8), clock)
    assert forecast.seconds_left() is None
    clock.now += 4
    forecast.record_frame(8)
    assert forecast.seconds_left() == 2 * 4


@pytest.mark.parametrize(
    ("seconds", "message"),
    [(0.4, "0 s"), (59.4, "59 s"), (200, "3 min 20 s"), (7500, "2 h 5 min")],
)
def test_durations_are_printed_in_readable_units(seconds, message):
    assert format_duration(seconds) == message
