"""Logs an encode for TensorBoard by torch's `SummaryWriter`."""

from collections.abc import Callable
from pathlib import Path

from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate, FrameWritten, TrainingStep


class TensorBoardLog:
    """A monitor that writes scalars and pictures; steps are counted over all frames.

    Args:
        folder: Folder for the event files; TensorBoard shows every folder as a run.

    Raises:
        ImportError: `tensorboard` is not installed.
        OSError: The folder cannot be created.
    """

    def __init__(self, folder: Path) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._writer = SummaryWriter(str(folder))
        self._last: TrainingStep | None = None

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        expected = estimate()
        self._writer.add_text("capture", plan.capture)
        self._writer.add_text("expected", f"{expected.seconds:.0f} s, {expected.byte_count:.0f} B")

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""
        at = step.step if step.frame == 0 else (step.frame - 1) * step.steps + step.step
        self._writer.add_scalar(f"{step.stage}/loss", step.loss(), at)
        self._writer.add_scalar(f"{step.stage}/train PSNR", step.psnr(), at)
        self._writer.add_scalar(f"{step.stage}/Gaussians", step.gaussians, at)
        self._last = step

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""
        for name, value in (
            ("bytes", frame.byte_count),
            ("Gaussians", frame.gaussians),
            ("births", frame.births),
            ("deaths", frame.deaths),
        ):
            self._writer.add_scalar(f"frame/{name}", value, frame.frame)
        if self._last is not None and self._last.frame == frame.frame:
            picture = self._last.image.detach().clamp(0, 1)
            self._writer.add_image("frame/train view", picture, frame.frame, dataformats="HWC")
        self._writer.flush()

    def end(self) -> None:
        """See `Monitor.end`."""
        self.close()

    def close(self) -> None:
        """Flush and close the files."""
        self._writer.close()
