"""Separates the time of frame 0 from the time of later frames."""

from quarc_ref.encoder.stage_timer import StageTimer

FIRST_TIMED_FRAME = 2
STAGES = ("anchors", "motion", "placement", "births", "commit")


class SteadyTimer:
    """Measures the training time of frame 0, and the time of the frames from the third on.

    Attributes:
        canonical_seconds: Training time of frame 0 in seconds.
        stage_timer: Timer of the stages; it is cleared before the third frame, so its times are
            those of the third and later frames.
    """

    def __init__(self) -> None:
        self.canonical_seconds = 0.0
        self.stage_timer = StageTimer()

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        self.stage_timer.advance(stage, done, total)
        if stage == "frames" and done == FIRST_TIMED_FRAME:
            self.canonical_seconds = self.stage_timer.seconds["canonical"]
            self.stage_timer.seconds.clear()
