"""Validates checkpoints of the canonical frame before they are used.

The file may be writable by other users, and kernels do not check their arguments, so
types, shapes and values are checked here.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from quarc_ref.encoder.resume.array_file import Arrays, Kind, Layout

_GAUSSIANS, _VIEWS = "Gaussians", "views"


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of the values in a checkpoint.

    Attributes:
        gaussians: Maximum number of Gaussians.
        views: Number of views.
        iterations: Number of training iterations.
    """

    gaussians: int
    views: int
    iterations: int

    def describe_layout(self, fresh: Arrays, of_gaussians: Collection[str]) -> Layout:
        """Return the types and shapes of the training's arrays at any step.

        Args:
            fresh: Initial state of the training.
            of_gaussians: Names of the arrays that have one row per Gaussian; scalars among them are
                not affected.
        """
        kinds: dict[str, Kind] = {}
        for name, array in fresh.items():
            rows = (_GAUSSIANS,) if name in of_gaussians and array.ndim else ()
            kinds[name] = (array.dtype.str, (*rows, *array.shape[len(rows) :]))
        kinds["left"] = (kinds["left"][0], (_VIEWS,))
        lengths = {_GAUSSIANS: range(1, self.gaussians + 1), _VIEWS: range(self.views + 1)}
        return Layout(kinds, lengths)

    def are_valid(self, saved: Arrays) -> bool:
        """Return whether this training could have produced the values of the arrays."""
        squares = [array for name, array in saved.items() if name.endswith(".exp_avg_sq")]
        return (
            0 < int(saved["step"]) <= self.iterations
            and all(0 <= view < self.views for view in saved["left"].tolist())
            and all(bool(np.isfinite(array).all()) for array in saved.values())
            and all(bool((array >= 0).all()) for array in squares)
            and _is_generator_state(saved["generator"])
        )


def _is_generator_state(state: NDArray[np.uint8]) -> bool:
    try:
        torch.Generator().set_state(torch.from_numpy(state))
    except RuntimeError:
        return False
    return True
