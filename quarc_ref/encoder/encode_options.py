"""What `encode` is asked to do with a capture."""

from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.findings import UNEVEN_LENGTHS, Report, ignore
from quarc_ref.encoder.checks.capture_checks import check_capture
from quarc_ref.encoder.monitoring.monitor import Monitor, NullMonitor
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import choose_preset


@dataclass(frozen=True, slots=True)
class EncodeOptions:
    """How to encode a capture.

    Attributes:
        config: All settings of training and stream.
        frames: How many, from the first; None for all.
        device: `cpu`, `cuda`, or `auto`: CUDA where there is one and gsplat with it.
        progress: Is told of every step.
        checkpoint: File that keeps the training of frame 0 from minute to minute,
            until the frame is written; what it holds of this encode is gone on
            with. None to keep nothing.
        checks: Whether to check the capture before frame 0 is trained.
        report: Is called with everything that speaks against a good picture.
        monitor: Is called for every training step and every frame.
    """

    config: EncoderConfig = field(default_factory=lambda: choose_preset("main"))
    frames: int | None = None
    device: str = "auto"
    progress: Progress = field(default_factory=NullProgress)
    checkpoint: Path | None = None
    checks: bool = True
    report: Report = ignore
    monitor: Monitor = field(default_factory=NullMonitor)

    def check(self, capture: Capture) -> None:
        """Report what speaks against a good picture of a capture, if it is to be checked.

        Raises:
            UnusableCaptureError: No picture can come of the capture.
            CaptureError: A picture cannot be read.
        """
        if self.checks:
            cut_as_asked = self.frames is not None
            for finding in (*capture.findings, *check_capture(capture)):
                if not (cut_as_asked and finding.kind == UNEVEN_LENGTHS):
                    self.report(finding)
