"""Separates the time of frame 0 from the time of later frames."""

from quarc_ref.encoder.stage_timer import StageTimer

FIRST_FRAME = 2
STAGES = ("anchors", "motion", "placement", "births", "commit")


class SteadyTimer:
    """Measures the time of the canonical scene, and of the frames from the third frame on.

    Attributes:
        canonical_seconds: Seconds of training the canonical scene.
        timer: Timer of the stages; it contains only frames from the third frame on.
    """

    def __init__(self) -> None:
        self.canonical_seconds = 0.0
        self.timer = StageTimer()

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        self.timer.advance(stage, done, total)
        if stage == "frames" and done == FIRST_FRAME:
            self.canonical_seconds = self.timer.seconds["canonical"]
            self.timer.seconds.clear()
