"""Separates the seconds of frame 0 from those of steady frames."""

from quarc_ref.encoder.stage_timer import StageTimer

FIRST_FRAME = 2
STAGES = ("anchors", "motion", "placement", "births", "commit")


class SteadyTimer:
    """Measures the seconds of the canonical scene and of steady frames.

    Attributes:
        canonical: Seconds of the canonical scene's training.
        timer: Timer of the frames from the third on, once they are reached.
    """

    def __init__(self) -> None:
        self.canonical = 0.0
        self.timer = StageTimer()

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        self.timer.advance(stage, done, total)
        if stage == "frames" and done == FIRST_FRAME:
            self.canonical = self.timer.seconds["canonical"]
            self.timer.seconds.clear()
