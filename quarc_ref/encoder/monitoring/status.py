"""Formats the status of an encode in one line: frame, PSNR, Gaussians, bytes, time left."""

import time
from collections import deque
from collections.abc import Callable
from statistics import fmean

from quarc_ref.encoder.monitoring.forecast import Forecast
from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate, FrameWritten, TrainingStep

_KILOBYTE = 1024
# steps between measurements of the PSNR, which takes about as long as the loss
_SECONDS_BETWEEN_SAMPLES = 0.25
_SAMPLES = 12


class EncodeStatus:
    """A monitor that stores the status of an encode.

    Args:
        announce: Called with the estimate before training starts; None for no estimate.
        clock: Function that returns seconds since an arbitrary time.
    """

    def __init__(
        self,
        announce: Callable[[EncodePlan, Estimate], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._announce, self._clock = announce, clock
        self._forecast: Forecast | None = None
        self._psnr: deque[float] = deque(maxlen=_SAMPLES)
        self._next_sample = 0.0
        self._gaussians = 0
        self._byte_count = 0

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        if self._announce is not None:
            self._announce(plan, estimate())
        self._forecast = Forecast(plan, self._clock)
        self._byte_count = plan.byte_count

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""
        if self._forecast is not None:
            self._forecast.record_step(step.stage, step.step)
        self._gaussians = step.gaussians
        now = self._clock()
        if now >= self._next_sample:
            self._psnr.append(step.psnr())
            self._next_sample = now + _SECONDS_BETWEEN_SAMPLES

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""
        if self._forecast is not None:
            self._forecast.record_frame(frame.frame)
        self._gaussians, self._byte_count = frame.gaussians, frame.total_bytes

    def end(self) -> None:
        """See `Monitor.end`."""

    def describe(self) -> str:
        """Return the status without the frame: `31.20 dB train, 8,950 Gaussians, 95.1 KB, ...`."""
        parts = []
        if self._psnr:
            parts.append(f"{fmean(self._psnr):.1f} dB train")
        if self._gaussians:
            parts.append(f"{self._gaussians:,} Gaussians")
        if self._byte_count:
            parts.append(f"{self._byte_count / _KILOBYTE:,.1f} KB")
        left = None if self._forecast is None else self._forecast.seconds_left()
        if left is not None:
            parts.append(f"{format_duration(left)} left")
        return ", ".join(parts)


def format_duration(seconds: float) -> str:
    """Format a duration: `45 s`, `3 min 20 s`, `2 h 5 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min"
