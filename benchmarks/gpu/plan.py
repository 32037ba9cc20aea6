"""Lists the steps in order, with their time limits, and the sizes of all measurements."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol

from gpu.rows import RowLog


@dataclass(frozen=True, slots=True)
class Sizes:
    """Device, picture size and counts of the measurements.

    Attributes:
        device: Name of the torch device: `cuda`, or `cpu` for a dry run.
        width: Width of pictures in pixels.
        height: Height of pictures in pixels.
        views: Number of training views.
        gaussians: Number of Gaussians in the timed frame.
        iterations: Number of motion iterations, and also of birth iterations, in the timed frame.
        canonical_iterations: Number of training iterations of frame 0.
        random_scene_sizes: Numbers of Gaussians in the random scenes used to compare backends.
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
DRY_RUN_SIZES = Sizes("cpu", 48, 36, 3, 200, 3, 10, (20, 60))


class StepFunction(Protocol):
    """The function that runs a step."""

    def __call__(self, sizes: Sizes, folder: Path, row_log: RowLog) -> None:
        """Run the step, and append its rows to a log.

        Args:
            sizes: Device, picture size and counts.
            folder: Folder shared by all steps.
            row_log: File for the rows.
        """
        ...


@dataclass(frozen=True, slots=True)
class Step:
    """A step, which runs in a separate process.

    Attributes:
        name: Name of the step in the table.
        time_limit: Maximum time of the step in seconds; the time left for all steps also limits it.
        module: Module with the function `run`.
        is_required: Whether a failure of the step stops the run.
    """

    name: str
    time_limit: float
    module: str
    is_required: bool = False

    def import_function(self) -> Callable[[Sizes, Path, RowLog], None]:
        """Import the module of the step, and return its function `run`."""
        function: StepFunction = import_module(self.module).run
        return function


STEPS = (
    Step("machine", 60, "gpu.machine", is_required=True),
    Step("backends", 300, "gpu.agreement"),  # gsplat compiles its kernels first
    Step("tests", 90, "gpu.cuda_tests"),
    Step("scene", 120, "gpu.scene"),
    Step("frame", 150, "gpu.later_frame"),
    Step("frame 0", 420, "gpu.first_frame"),
)
