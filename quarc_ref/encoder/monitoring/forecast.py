"""Forecasts the remaining time of an encode from the time so far."""

import time
from collections import deque
from collections.abc import Callable
from statistics import fmean

from quarc_ref.encoder.monitoring.monitor import EncodePlan

# Time of a frame in canonical steps, measured by benchmarks/encode.py: the steps have
# different costs, and work between them renders view by view.
_MOTION_STEP, _BIRTH_STEP, _VIEW = 1.2, 0.3, 1.4
_RECENT_STEPS, _RECENT_FRAMES = 50, 8


def frame_seconds(plan: EncodePlan, step_seconds: float) -> float:
    """Estimate the time of a frame after the first.

    Args:
        plan: Plan of the encode.
        step_seconds: Duration of an iteration of frame 0, seconds.
    """
    steps = plan.motion_steps * _MOTION_STEP + plan.birth_steps * _BIRTH_STEP
    return step_seconds * (steps + plan.views * _VIEW)


class Forecast:
    """Forecast of the remaining time, updated during an encode.

    Args:
        plan: The remaining work.
        clock: Function that returns seconds since an arbitrary time.
    """

    def __init__(self, plan: EncodePlan, clock: Callable[[], float] = time.monotonic) -> None:
        self._plan, self._clock = plan, clock
        self._steps: deque[float] = deque(maxlen=_RECENT_STEPS)
        self._frames: deque[float] = deque(maxlen=_RECENT_FRAMES)
        self._steps_left = plan.canonical_steps if plan.first_frame == 0 else 0
        self._next_frame = plan.first_frame
        self._frame_begun = clock()

    def record_step(self, stage: str, step: int) -> None:
        """Record that a step of a stage, counted from 1, is done."""
        if stage == "canonical":
            self._steps.append(self._clock())
            self._steps_left = self._plan.canonical_steps - step

    def record_frame(self, frame: int) -> None:
        """Record that a frame has been written."""
        now = self._clock()
        if frame > 0:
            self._frames.append(now - self._frame_begun)
        self._next_frame, self._frame_begun = frame + 1, now
        self._steps_left = 0

    def seconds_left(self) -> float | None:
        """Return the remaining time of the whole encode; None before the first measurement."""
        frames = self._plan.frames - max(1, self._next_frame)
        if self._frames:
            passed = self._clock() - self._frame_begun
            return max(0.0, fmean(self._frames) * frames - passed)
        if len(self._steps) < 2:
            return None
        step = (self._steps[-1] - self._steps[0]) / (len(self._steps) - 1)
        passed = self._clock() - self._frame_begun if self._next_frame else 0.0
        left = self._steps_left * step + frames * frame_seconds(self._plan, step)
        return max(0.0, left - passed)
