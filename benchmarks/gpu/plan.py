"""The steps in order, with their time limits and sizes."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol

from gpu.rows import Notebook


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of the measurements.

    Attributes:
        device: `cuda`, or `cpu` for a dry run.
        width: Width of pictures in pixels.
        height: Height of pictures in pixels.
        views: Training views.
        gaussians: Number of Gaussians of the timed frame.
        iterations: Iterations of its motion, and of its births.
        canonical: Iterations of frame 0.
        random: Number of Gaussians of the random scenes for comparing backends.
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
    """The work of a step."""

    def __call__(self, sizes: Sizes, folder: Path, notebook: Notebook) -> None:
        """Run the step and write its rows.

        Args:
            sizes: Of everything.
            folder: Folder shared by all steps.
            notebook: To write into.
        """
        ...


@dataclass(frozen=True, slots=True)
class Step:
    """A part of the run, in a separate process.

    Attributes:
        name: In the table.
        seconds: Time limit; the step is also limited by the time that earlier steps leave.
        module: Module with the function `work`.
        is_required: Whether no other step can run if this one fails.
    """

    name: str
    seconds: float
    module: str
    is_required: bool = False

    def load(self) -> Callable[[Sizes, Path, Notebook], None]:
        """Import the step's module and return its function."""
        work: Work = import_module(self.module).work
        return work


STEPS = (
    Step("machine", 60, "gpu.machine", is_required=True),
    Step("backends", 300, "gpu.agreement"),  # gsplat compiles its kernels first
    Step("tests", 90, "gpu.cuda_tests"),
    Step("scene", 120, "gpu.scene"),
    Step("frame", 150, "gpu.moved_frame"),
    Step("frame 0", 420, "gpu.first_frame"),
)
