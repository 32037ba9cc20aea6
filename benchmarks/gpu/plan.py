"""The steps, in order, how long each may take, and in which sizes."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol

from gpu.rows import Notebook


@dataclass(frozen=True, slots=True)
class Sizes:
    """How much of everything.

    Attributes:
        device: `cuda`, or `cpu` for a dry run.
        width: Pixels of a picture.
        height: Pixels of a picture.
        views: Training views.
        gaussians: Of the frame that is timed.
        iterations: Of its motion, and as many of its births.
        canonical: Iterations of frame 0.
        random: Gaussians of the random scenes that backends draw.
    """

    device: str
    width: int
    height: int
    views: int
    gaussians: int
    iterations: int
    canonical: int
    random: tuple[int, ...]


REAL = Sizes("cuda", 1352, 1014, 20, 244_000, 100, 15_000, (200, 2000, 20_000))
DRY = Sizes("cpu", 48, 36, 3, 200, 3, 10, (20, 60))


class Work(Protocol):
    """What a step does."""

    def __call__(self, sizes: Sizes, folder: Path, notebook: Notebook) -> None:
        """Find out, and write rows.

        Args:
            sizes: Of everything.
            folder: That steps share, for what one makes for another.
            notebook: To write into.
        """
        ...


@dataclass(frozen=True, slots=True)
class Step:
    """A part of the run, in a process of its own.

    Attributes:
        name: In the table.
        seconds: It may take; what earlier steps leave of the whole time is a limit, too.
        module: That has it, as its function `work`.
        is_vital: Whether no other step can do anything if this one fails.
    """

    name: str
    seconds: float
    module: str
    is_vital: bool = False

    def load(self) -> Callable[[Sizes, Path, Notebook], None]:
        """Return what the step does, its libraries loaded."""
        work: Work = import_module(self.module).work
        return work


STEPS = (
    Step("machine", 60, "gpu.machine", is_vital=True),
    Step("backends", 300, "gpu.agreement"),  # gsplat compiles its kernels first
    Step("tests", 90, "gpu.cuda_tests"),
    Step("scene", 120, "gpu.scene"),
    Step("frame", 150, "gpu.moved_frame"),
    Step("frame 0", 420, "gpu.first_frame"),
)
