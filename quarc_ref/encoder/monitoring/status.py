"""Formats the status of an encode as one line: PSNR, Gaussians, bytes and remaining time."""

import math
import time
from collections import deque
from collections.abc import Callable
from statistics import fmean

from quarc_ref.encoder.monitoring.forecast import TimeForecast
from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate, FrameWritten, TrainingStep

_KILOBYTE = 1024
# computing the PSNR takes about as long as computing the loss, so not every step is sampled
_SECONDS_BETWEEN_SAMPLES = 0.25
_SAMPLE_COUNT = 12


class EncodeStatus:
    """A monitor that describes the current status of an encode.

    Args:
        announce: Function that is called with the plan and the estimate before training starts.
            If `announce` is None, no estimate is computed.
        clock: Function that returns seconds since an arbitrary time.
    """

    def __init__(
        self,
        announce: Callable[[EncodePlan, Estimate], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._announce, self._clock = announce, clock
        self._forecast: TimeForecast | None = None
        self._psnr_samples: deque[float] = deque(maxlen=_SAMPLE_COUNT)
        self._next_sample_time = 0.0
        self._gaussian_count = 0
        self._byte_count = 0

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        if self._announce is not None:
            self._announce(plan, estimate())
        self._forecast = TimeForecast(plan, self._clock)
        self._byte_count = plan.byte_count

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""
        if self._forecast is not None:
            self._forecast.record_step(step.stage, step.step)
        self._gaussian_count = step.gaussians
        now = self._clock()
        if now >= self._next_sample_time:
            psnr = step.psnr()
            if math.isfinite(psnr):
                self._psnr_samples.append(psnr)
            self._next_sample_time = now + _SECONDS_BETWEEN_SAMPLES

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""
        if self._forecast is not None:
            self._forecast.record_frame(frame.frame)
        self._gaussian_count, self._byte_count = frame.gaussians, frame.total_bytes

    def end(self) -> None:
        """See `Monitor.end`."""

    def describe(self) -> str:
        """Return the status, such as `31.2 dB train, 8,950 Gaussians, 95.1 KB, 2 h 5 min left`."""
        parts = []
        if self._psnr_samples:
            parts.append(f"{fmean(self._psnr_samples):.1f} dB train")
        if self._gaussian_count:
            parts.append(f"{self._gaussian_count:,} Gaussians")
        if self._byte_count:
            parts.append(f"{self._byte_count / _KILOBYTE:,.1f} KB")
        seconds_left = None if self._forecast is None else self._forecast.seconds_left()
        if seconds_left is not None:
            parts.append(f"{format_duration(seconds_left)} left")
        return ", ".join(parts)


def format_duration(seconds: float) -> str:
    """Format a duration as `45 s`, `3 min 20 s` or `2 h 5 min`."""
    total_seconds = round(seconds)
    if total_seconds < 60:
        return f"{total_seconds} s"
    minutes, remaining_seconds = divmod(total_seconds, 60)
    if minutes < 60:
        return f"{minutes} min {remaining_seconds} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min"
