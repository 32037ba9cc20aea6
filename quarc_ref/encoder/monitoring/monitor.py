"""Interface for callbacks that observe an encode without affecting the stream."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from torch import Tensor

_MIN_MASK_FRACTION = 1e-12  # avoids a division by 0 if all pixels are masked


@dataclass(frozen=True, slots=True)
class EncodePlan:
    """The number of frames and training steps of an encode.

    Attributes:
        capture: Name of the capture.
        frames: Number of frames in the complete stream.
        first_frame: Index of the first frame to encode; above 0 if a partial stream is resumed.
        byte_count: Size of the partial stream that is resumed, bytes; 0 for a new stream.
        views: Number of training views.
        canonical_steps: Number of training steps of frame 0, of all scenes of the ensemble.
        half_resolution_steps: Number of these steps that use half the width and height; usually
            the first ones.
        motion_steps: Number of training steps for the motion of each frame after frame 0.
        birth_steps: Number of training steps for the births of each frame after frame 0.
    """

    capture: str
    frames: int
    first_frame: int
    byte_count: int
    views: int
    canonical_steps: int
    half_resolution_steps: int
    motion_steps: int
    birth_steps: int


@dataclass(frozen=True, slots=True)
class Estimate:
    """Expected duration of an encode, and size of its stream.

    Attributes:
        seconds: Duration of the remaining work, seconds.
        byte_count: Size of the complete stream, bytes.
    """

    seconds: float
    byte_count: float


@dataclass(frozen=True, slots=True, eq=False)
class TrainingStep:
    """One training step, and the training view that it renders.

    Attributes:
        stage: `canonical`, `motion` or `births`.
        frame: Ordinal of the frame.
        step: Index of the step in its stage, from 1. The steps of all scenes of the ensemble of
            frame 0 are numbered consecutively.
        steps: Number of steps of the stage.
        gaussians: Number of rendered Gaussians.
        loss_tensor: The loss, a scalar in the autograd graph.
        image: `[H, W, 3]` rendering.
        truth: Function that returns the `[H, W, 3]` ground truth of the view.
        mask: `[H, W, 1]` mask: 1 for pixels that training uses, else 0; None if all are used.
    """

    stage: str
    frame: int
    step: int
    steps: int
    gaussians: int
    loss_tensor: "Tensor"
    image: "Tensor"
    truth: Callable[[], "Tensor"]
    mask: "Tensor | None" = None

    def loss(self) -> float:
        """Return the loss, including rate terms and regularizers."""
        return float(self.loss_tensor.detach())

    def psnr(self) -> float:
        """Return the PSNR in dB; infinite for the ground truth, and if all pixels are masked."""
        squared_error = (self.image.detach().clamp(0, 1) - self.truth().clamp(0, 1)).square()
        mean_squared_error = float(
            (squared_error if self.mask is None else squared_error * self.mask).mean()
        )
        if self.mask is not None:
            mean_squared_error /= max(float(self.mask.mean()), _MIN_MASK_FRACTION)
        return -10 * math.log10(mean_squared_error) if mean_squared_error else math.inf


@dataclass(frozen=True, slots=True)
class FrameWritten:
    """A frame that has been written to the stream.

    Attributes:
        frame: Ordinal of the frame.
        kind: `canonical`, `snapshot` or `moved`.
        byte_count: Size of the frame's chunk in bytes, including framing.
        total_bytes: Size of the stream so far, bytes.
        gaussians: Number of Gaussians in the frame.
        births: Number of Gaussians that the frame adds.
        deaths: Number of Gaussians that the frame deletes.
    """

    frame: int
    kind: str
    byte_count: int
    total_bytes: int
    gaussians: int
    births: int
    deaths: int


class Monitor(Protocol):
    """Callbacks that the encoding thread calls."""

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """Receive the plan before encoding starts.

        Args:
            plan: Frames and training steps of the encode.
            estimate: Function that estimates the duration and size of the encode. Calling this
                function takes one or two seconds.
        """
        ...

    def step(self, step: TrainingStep) -> None:
        """Receive a training step."""
        ...

    def frame(self, frame: FrameWritten) -> None:
        """Receive the properties of a frame that has been written."""
        ...

    def end(self) -> None:
        """Finish monitoring; called when the stream is complete."""
        ...


class NullMonitor:
    """A monitor that ignores all calls."""

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""

    def end(self) -> None:
        """See `Monitor.end`."""


class MonitorGroup:
    """A monitor that forwards all calls to several monitors and computes the estimate once.

    Args:
        monitors: Monitors, which are called in this order.
    """

    def __init__(self, monitors: Sequence[Monitor]) -> None:
        self._monitors = tuple(monitors)

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        estimates: list[Estimate] = []

        def estimate_once() -> Estimate:
            if not estimates:
                estimates.append(estimate())
            return estimates[0]

        for monitor in self._monitors:
            monitor.begin(plan, estimate_once)

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""
        for monitor in self._monitors:
            monitor.step(step)

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""
        for monitor in self._monitors:
            monitor.frame(frame)

    def end(self) -> None:
        """See `Monitor.end`."""
        for monitor in self._monitors:
            monitor.end()
