"""Measures the time of each stage of an encode from its progress calls."""

import time
from collections.abc import Callable

from quarc_ref.encoder.progress import NullProgress, Progress

# Name of the stage to which the time between the steps of two different stages belongs.
_TRANSITION_STAGES = {
    ("canonical", "frames"): "canonical commit",
    ("frames", "motion"): "anchors",
    ("motion", "births"): "placement",
    ("motion", "frames"): "commit",
    ("births", "frames"): "commit",
}


class StageTimer:
    """Accumulates the seconds spent in each stage, and forwards progress calls.

    Args:
        next_progress: Receiver of forwarded calls; None: calls are not forwarded.
        clock: Function that returns seconds since an arbitrary time.

    Attributes:
        seconds: Seconds by stage. `canonical` and `canonical commit` are the times of frame 0.
            The other stages are sums over later frames: `anchors` (sampling, binding, warm
            start), `motion`, `placement` (coding the motion, placing new Gaussians), `births`,
            and `commit` (coding the births, writing and decoding the frame). The first step of
            a stage counts toward the preceding stage.
    """

    def __init__(
        self, next_progress: Progress | None = None, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._next_progress = next_progress or NullProgress()
        self._clock = clock
        self._last_time = clock()
        self._stage: str | None = None
        self.seconds: dict[str, float] = {}

    def skip(self) -> None:
        """Exclude the time since the last step from all stages."""
        self._last_time = self._clock()

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        now = self._clock()
        name = stage
        if self._stage is not None:
            name = _TRANSITION_STAGES.get((self._stage, stage), stage)
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last_time
        self._next_progress.advance(stage, done, total)
        self._last_time, self._stage = self._clock(), stage
