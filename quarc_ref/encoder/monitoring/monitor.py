"""Callbacks during an encode, which do not affect the stream."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from torch import Tensor

_MIN_SHARE = 1e-12  # minimum share of a view's pixels


@dataclass(frozen=True, slots=True)
class EncodePlan:
    """The work of an encode.

    Attributes:
        capture: Name of the capture.
        frames: Number of frames of the complete stream.
        first_frame: First frame to encode; above 0 in a resumed encode.
        byte_count: Number of bytes that the stream already has.
        views: Number of training cameras.
        canonical_steps: Number of iterations of frame 0.
        motion_steps: Number of iterations of a later frame's motion.
        birth_steps: Number of iterations of a later frame's births.
    """

    capture: str
    frames: int
    first_frame: int
    byte_count: int
    views: int
    canonical_steps: int
    motion_steps: int
    birth_steps: int


@dataclass(frozen=True, slots=True)
class Estimate:
    """Expected duration and size of an encode.

    Attributes:
        seconds: Duration of the encode.
        byte_count: Size of the stream.
    """

    seconds: float
    byte_count: float


@dataclass(frozen=True, slots=True, eq=False)
class TrainingStep:
    """One iteration of training, on one training view.

    Attributes:
        stage: `canonical`, `motion` or `births`.
        frame: Ordinal of the frame.
        step: Number of the iteration in its stage, from 1.
        steps: Number of iterations of the stage.
        gaussians: Number of rendered Gaussians.
        loss_tensor: The loss, a scalar in the graph.
        image: `[H, W, 3]` rendering.
        truth: Function that returns the `[H, W, 3]` ground truth of the view.
        mask: `[H, W, 1]` mask, 1 for pixels to use; None to use all.
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
        """Return the PSNR of the view, dB; infinite if it equals the truth."""
        square = (self.image.detach().clamp(0, 1) - self.truth()).square()
        error = float((square if self.mask is None else square * self.mask).mean())
        if self.mask is not None:
            error /= max(float(self.mask.mean()), _MIN_SHARE)
        return -10 * math.log10(error) if error else math.inf


@dataclass(frozen=True, slots=True)
class FrameWritten:
    """A frame that has been written to the stream.

    Attributes:
        frame: Ordinal of the frame.
        kind: `canonical`, `snapshot` or `moved`.
        byte_count: Size of its chunk including framing, bytes.
        total_bytes: Size of the stream so far.
        gaussians: Number of Gaussians.
        births: Number of births.
        deaths: Number of deaths.
    """

    frame: int
    kind: str
    byte_count: int
    total_bytes: int
    gaussians: int
    births: int
    deaths: int


class Monitor(Protocol):
    """Interface of callbacks, which are called during an encode by the encoding thread."""

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """Receive the plan before encoding starts.

        Args:
            plan: The remaining work.
            estimate: Function that estimates the time of the encode, in one or two seconds.
        """
        ...

    def step(self, step: TrainingStep) -> None:
        """Receive an iteration of training."""
        ...

    def frame(self, frame: FrameWritten) -> None:
        """Receive a frame that has been written."""
        ...

    def end(self) -> None:
        """Receive the end of the encode, when the stream is complete."""
        ...


class NullMonitor:
    """A monitor that ignores everything."""

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""

    def step(self, step: TrainingStep) -> None:
        """See `Monitor.step`."""

    def frame(self, frame: FrameWritten) -> None:
        """See `Monitor.frame`."""

    def end(self) -> None:
        """See `Monitor.end`."""


class Monitors:
    """Forwards all calls to several monitors; the estimate is computed once.

    Args:
        monitors: Monitors in the order of the calls.
    """

    def __init__(self, monitors: Sequence[Monitor]) -> None:
        self._monitors = tuple(monitors)

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """See `Monitor.begin`."""
        found: list[Estimate] = []

        def estimate_once() -> Estimate:
            if not found:
                found.append(estimate())
            return found[0]

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
