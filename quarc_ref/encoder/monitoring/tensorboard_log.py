"""Logs an encode for TensorBoard, with torch's `SummaryWriter`."""

from collections.abc import Callable
from pathlib import Path

from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate, FrameWritten, TrainingStep


class TensorBoardLog:
    """A monitor that writes scalars and pictures for TensorBoard.

    The steps of each stage are numbered consecutively over all frames.

    Args:
        folder: Folder for the event files; TensorBoard shows each folder as a run.

    Raises:
        ImportError: `tensorboard` is not installed.
        OSError: The folder cannot be created.
    """

    def __init__(self, folder: Path) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._writer = SummaryWriter(str(folder))
        self._last_step: TrainingStep | None = None

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        encode_estimate = estimate()
        self._writer.add_text("capture", plan.capture)
        self._writer.add_text(
            "expected", f"{encode_estimate.seconds:.0f} s, {encode_estimate.byte_count:.0f} B"
        )

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""
        global_step = step.step if step.frame == 0 else (step.frame - 1) * step.steps + step.step
        self._writer.add_scalar(f"{step.stage}/loss", step.loss(), global_step)
        self._writer.add_scalar(f"{step.stage}/train PSNR", step.psnr(), global_step)
        self._writer.add_scalar(f"{step.stage}/Gaussians", step.gaussians, global_step)
        self._last_step = step

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""
        for name, value in (
            ("bytes", frame.byte_count),
            ("Gaussians", frame.gaussians),
            ("births", frame.births),
            ("deaths", frame.deaths),
        ):
            self._writer.add_scalar(f"frame/{name}", value, frame.frame)
        if self._last_step is not None and self._last_step.frame == frame.frame:
            picture = self._last_step.image.detach().clamp(0, 1)
            self._writer.add_image("frame/train view", picture, frame.frame, dataformats="HWC")
        self._writer.flush()

    def end(self) -> None:
        """See `Monitor.end`."""
        self.close()

    def close(self) -> None:
        """Flush and close the event files."""
        self._writer.close()
