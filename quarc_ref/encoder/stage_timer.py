"""Measures the time of the stages of an encode from its progress calls."""

import time
from collections.abc import Callable

from quarc_ref.encoder.progress import NullProgress, Progress

# Time between the last step of one stage and the first step of the next.
_BETWEEN = {
    ("canonical", "frames"): "canonical commit",
    ("frames", "motion"): "anchors",
    ("motion", "births"): "placement",
    ("motion", "frames"): "commit",
    ("births", "frames"): "commit",
}


class StageTimer:
    """Accumulates the seconds of every stage, and forwards the progress.

    Args:
        then: Progress to which every step is forwarded.
        clock: Function that returns seconds since an arbitrary time.

    Attributes:
        seconds: Seconds by stage: `canonical` for frame 0; for all later frames `anchors`
            (sampling, binding, warm start), `motion`, `placement` (commit of the motion,
            placement of new Gaussians), `births` and `commit` (of births and frame, and
            its decoding). The first step of a stage is counted in the previous stage.
    """

    def __init__(
        self, then: Progress | None = None, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._then = then or NullProgress()
        self._clock = clock
        self._last = clock()
        self._stage: str | None = None
        self.seconds: dict[str, float] = {}

    def skip(self) -> None:
        """Do not count the time since the last step."""
        self._last = self._clock()

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        now = self._clock()
        name = stage
        if self._stage is not None:
            name = _BETWEEN.get((self._stage, stage), stage)
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._then.advance(stage, done, total)
        self._last, self._stage = self._clock(), stage
