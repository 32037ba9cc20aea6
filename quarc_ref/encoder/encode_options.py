"""Options of `encode`."""

from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.findings import UNEVEN_LENGTHS, FindingCallback, ignore_finding
from quarc_ref.encoder.checks.capture_checks import check_capture
from quarc_ref.encoder.monitoring.monitor import Monitor, NullMonitor
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import choose_preset


@dataclass(frozen=True, slots=True)
class EncodeOptions:
    """Options of an encode.

    Attributes:
        config: All settings of the training and the stream.
        frames: Number of frames; None for all.
        device: `cpu`, `cuda`, or `auto` (CUDA if a CUDA device and gsplat are available).
        progress: Called after every training step.
        checkpoint: File to which the training state of frame 0 is saved every minute. If the
            file already exists and belongs to this encode, training resumes from it. If
            `checkpoint` is None, the training state is not saved.
        checks: Whether to check the capture before frame 0 is trained.
        report: Called with every finding (a reason to expect poor quality).
        monitor: Called for every training step on a training view, and for every frame.
    """

    config: EncoderConfig = field(default_factory=lambda: choose_preset("main"))
    frames: int | None = None
    device: str = "auto"
    progress: Progress = field(default_factory=NullProgress)
    checkpoint: Path | None = None
    checks: bool = True
    report: FindingCallback = ignore_finding
    monitor: Monitor = field(default_factory=NullMonitor)

    def check(self, capture: Capture) -> None:
        """If `checks` is set, check a capture and report the findings.

        Raises:
            UnusableCaptureError: The capture cannot be encoded with acceptable quality.
            CaptureError: A picture cannot be read.
        """
        if self.checks:
            is_frame_count_requested = self.frames is not None
            for finding in (*capture.findings, *check_capture(capture)):
                if not (is_frame_count_requested and finding.kind == UNEVEN_LENGTHS):
                    self.report(finding)
