"""Callbacks during an encode; they do not change a byte of the stream."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from torch import Tensor

_LEAST_SHARE = 1e-12  # of the pixels of a view


@dataclass(frozen=True, slots=True)
class EncodePlan:
    """The work of an encode.

    Attributes:
        capture: Name of the capture.
        frames: How many the stream is to have.
        first_frame: The first that is still to be encoded; above 0 in an encode that resumes.
        byte_count: Bytes that the stream has already.
        views: Training cameras.
        canonical_steps: Iterations of frame 0.
        motion_steps: Iterations of the motion of a later frame.
        birth_steps: Iterations of the births of a later frame.
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
        seconds: How long it takes.
        byte_count: How large the stream is.
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
        gaussians: Number of Gaussians drawn.
        loss_tensor: The loss, a scalar in the graph.
        image: `[H, W, 3]` as drawn.
        truth: Returns the picture that the view is compared with, `[H, W, 3]`.
        mask: `[H, W, 1]` 1 for the pixels that count; None if all do.
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
        """Return the loss, prices of bytes and regularizers included."""
        return float(self.loss_tensor.detach())

    def psnr(self) -> float:
        """Return the PSNR of the view, dB; infinite if it equals the truth."""
        square = (self.image.detach().clamp(0, 1) - self.truth()).square()
        error = float((square if self.mask is None else square * self.mask).mean())
        if self.mask is not None:
            error /= max(float(self.mask.mean()), _LEAST_SHARE)
        return -10 * math.log10(error) if error else math.inf


@dataclass(frozen=True, slots=True)
class FrameWritten:
    """A frame that is in the stream.

    Attributes:
        frame: Its ordinal.
        kind: `canonical`, `snapshot` or `moved`.
        byte_count: Size of its chunk, framing included, bytes.
        total_bytes: Size of the stream so far.
        gaussians: How many it shows.
        births: How many joined in it.
        deaths: How many left before it.
    """

    frame: int
    kind: str
    byte_count: int
    total_bytes: int
    gaussians: int
    births: int
    deaths: int


class Monitor(Protocol):
    """Called during an encode, by the thread that encodes."""

    def begin(self, plan: EncodePlan, estimate: Callable[[], Estimate]) -> None:
        """Receive the plan, before the work begins.

        Args:
            plan: The remaining work.
            estimate: Measures how long it will take; this takes a second or two.
        """
        ...

    def step(self, step: TrainingStep) -> None:
        """Note an iteration of training."""
        ...

    def frame(self, frame: FrameWritten) -> None:
        """Note a frame that is in the stream."""
        ...

    def end(self) -> None:
        """Report that the stream is complete."""
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
    """Passes everything on to several monitors; the estimate is made once.

    Args:
        monitors: In the order in which they are called.
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
