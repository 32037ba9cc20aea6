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
        views: Number of training views.
        gaussians: Number of Gaussians of the timed frame.
        iterations: Iterations of motion and of births in the timed frame.
        canonical_iterations: Iterations of training frame 0.
        random_scene_sizes: Numbers of Gaussians of the random scenes that compare backends.
    """

    device: str
    width: int
    height: int
    views: int
    gaussians: int
    iterations: int
    canonical_iterations: int
    random_scene_sizes: tuple[int, ...]


REAL_SIZES = Sizes("cuda", 1352, 1014, 20, 244_000, 100, 15_000, (200, 2000, 20_000))
DRY_SIZES = Sizes("cpu", 48, 36, 3, 200, 3, 10, (20, 60))


class StepFunction(Protocol):
    """The function that runs a step."""

    def __call__(self, sizes: Sizes, folder: Path, notebook: Notebook) -> None:
        """Run the step, and write its rows into a notebook.

        Args:
            sizes: Device, picture size, and numbers of views, Gaussians and iterations.
            folder: Folder shared by all steps.
            notebook: File for the rows.
        """
        ...


@dataclass(frozen=True, slots=True)
class Step:
    """A step of the run, which is a separate process.

    Attributes:
        name: Name of the step in the table.
        seconds: Time limit of the step; the time left for all steps limits it further.
        module: Module with the function `work`.
        is_required: Whether a failure of the step stops the run.
    """

    name: str
    seconds: float
    module: str
    is_required: bool = False

    def load(self) -> Callable[[Sizes, Path, Notebook], None]:
        """Import the module of the step, and return its function `work`."""
        function: StepFunction = import_module(self.module).work
        return function


STEPS = (
    Step("machine", 60, "gpu.machine", is_required=True),
    Step("backends", 300, "gpu.agreement"),  # gsplat compiles its kernels first
    Step("tests", 90, "gpu.cuda_tests"),
    Step("scene", 120, "gpu.scene"),
    Step("frame", 150, "gpu.moved_frame"),
    Step("frame 0", 420, "gpu.first_frame"),
)
