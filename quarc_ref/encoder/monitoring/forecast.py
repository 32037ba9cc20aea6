"""Forecasts the remaining time of an encode from the durations of recent steps and frames."""

import time
from collections import deque
from collections.abc import Callable
from statistics import fmean

from quarc_ref.encoder.monitoring.monitor import EncodePlan

# Durations of a motion step, of a birth step, and of the other work per view and frame,
# relative to a step of frame 0 at full resolution. Measured by benchmarks/encode.py.
_MOTION_STEP_COST, _BIRTH_STEP_COST, _VIEW_COST = 1.2, 0.3, 1.4
# Duration of a step of frame 0 at half resolution, relative to a step at full resolution.
HALF_RESOLUTION_COST = 0.4
_RECENT_STEPS, _RECENT_FRAMES = 50, 8


def estimate_frame_seconds(plan: EncodePlan, step_seconds: float) -> float:
    """Estimate how many seconds each frame after frame 0 takes.

    Args:
        plan: Plan of the encode.
        step_seconds: Duration of a training step of frame 0 at full resolution, seconds.
    """
    weighted_steps = plan.motion_steps * _MOTION_STEP_COST + plan.birth_steps * _BIRTH_STEP_COST
    return step_seconds * (weighted_steps + plan.views * _VIEW_COST)


class TimeForecast:
    """Forecast of the remaining time, updated during an encode.

    Args:
        plan: Frames and training steps of the encode.
        clock: Function that returns seconds since an arbitrary time.
    """

    def __init__(self, plan: EncodePlan, clock: Callable[[], float] = time.monotonic) -> None:
        self._plan, self._clock = plan, clock
        self._recent_steps: deque[tuple[float, float]] = deque(maxlen=_RECENT_STEPS)
        self._frame_durations: deque[float] = deque(maxlen=_RECENT_FRAMES)
        self._work_left = self._work_until(plan.canonical_steps) if plan.first_frame == 0 else 0.0
        self._next_frame = plan.first_frame
        self._frame_start_time = clock()

    def record_step(self, stage: str, step: int) -> None:
        """Record that a step of a stage has just ended; the first step is 1."""
        if stage == "canonical":
            work = self._work_until(step)
            self._recent_steps.append((work, self._clock()))
            self._work_left = self._work_until(self._plan.canonical_steps) - work

    def record_frame(self, frame: int) -> None:
        """Record that a frame has just been written."""
        now = self._clock()
        if frame > 0:
            self._frame_durations.append(now - self._frame_start_time)
        self._next_frame, self._frame_start_time = frame + 1, now
        self._work_left = 0.0

    def seconds_left(self) -> float | None:
        """Return the remaining time of the encode in seconds; None before the first measurement."""
        remaining_frames = self._plan.frames - max(1, self._next_frame)
        if self._frame_durations:
            elapsed_seconds = self._clock() - self._frame_start_time
            return max(0.0, fmean(self._frame_durations) * remaining_frames - elapsed_seconds)
        if len(self._recent_steps) < 2:
            return None
        (first_work, first_time), *_, (last_work, last_time) = self._recent_steps
        step_seconds = (last_time - first_time) / (last_work - first_work)
        elapsed_seconds = self._clock() - self._frame_start_time if self._next_frame else 0.0
        remaining_seconds = (
            self._work_left * step_seconds
            + remaining_frames * estimate_frame_seconds(self._plan, step_seconds)
        )
        return max(0.0, remaining_seconds - elapsed_seconds)

    def _work_until(self, step: int) -> float:
        """Return the work of the first `step` steps of frame 0, in steps at full resolution."""
        half_resolution_steps = min(step, self._plan.half_resolution_steps)
        return step - (1 - HALF_RESOLUTION_COST) * half_resolution_steps
