"""Logs an encode as JSON lines (docs/schemas/encode-log.json): plan, steps and frames."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import TextIO

from quarc_ref.encoder.monitoring.forecast import TimeForecast
from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate, FrameWritten, TrainingStep

_SCHEMA = "encode-log/2"


class JsonLog:
    """A monitor that writes a JSON line for every event.

    Args:
        sink: Text file to which lines are appended.
        clock: Function that returns seconds since an arbitrary time.
    """

    def __init__(self, sink: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._sink, self._clock = sink, clock
        self._start_time = clock()
        self._forecast: TimeForecast | None = None

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        self._forecast = TimeForecast(plan, self._clock)
        self._write("begin", {**asdict(plan), "estimate": asdict(estimate())})

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""
        if self._forecast is not None:
            self._forecast.record_step(step.stage, step.step)
        self._write(
            "step",
            {
                "stage": step.stage,
                "frame": step.frame,
                "step": step.step,
                "steps": step.steps,
                "loss": _finite_or_none(step.loss()),
                "psnr": _finite_or_none(step.psnr()),
                "gaussians": step.gaussians,
            },
        )

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""
        seconds_left = None
        if self._forecast is not None:
            self._forecast.record_frame(frame.frame)
            seconds_left = self._forecast.seconds_left()
        self._write("frame", {**asdict(frame), "seconds_left": seconds_left})

    def end(self) -> None:
        """See `Monitor.end`."""
        self._write("end", {})

    def _write(self, event: str, values: dict[str, object]) -> None:
        seconds = round(self._clock() - self._start_time, 3)
        line = {"schema": f"quarc-ref/{_SCHEMA}", "event": event, "seconds": seconds, **values}
        self._sink.write(json.dumps(line, allow_nan=False) + "\n")
        if event != "step":
            self._sink.flush()


def _finite_or_none(number: float) -> float | None:
    return number if math.isfinite(number) else None
