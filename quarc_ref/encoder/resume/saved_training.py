"""Validates the arrays of a checkpoint before training uses them.

Other users may be able to change a checkpoint, and the renderer's kernels do not check their
arguments. Therefore, the types, shapes and values of the arrays are checked here.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from quarc_ref.encoder.resume.array_file import Arrays, ArrayType, Layout

GAUSSIANS, _VIEWS = "Gaussians", "views"


@dataclass(frozen=True, slots=True)
class CheckpointBounds:
    """Limits on the sizes and values of the arrays in a checkpoint.

    Attributes:
        gaussians: Maximum number of Gaussians.
        views: Number of views.
        iterations: Number of training iterations.
    """

    gaussians: int
    views: int
    iterations: int

    def describe_layout(self, initial_arrays: Arrays, row_names: Mapping[str, str]) -> Layout:
        """Return the layout that checkpoint arrays have at every step of this training run.

        Args:
            initial_arrays: Training state before the first step.
            row_names: For each array with one row per Gaussian, a name that it shares with the
                arrays of the same length: `GAUSSIANS`, or, if there may be no rows, another name.
                Scalars are ignored.
        """
        array_types: dict[str, ArrayType] = {}
        for name, array in initial_arrays.items():
            row_dimensions = (row_names[name],) if name in row_names and array.ndim else ()
            array_types[name] = (
                array.dtype.str,
                (*row_dimensions, *array.shape[len(row_dimensions) :]),
            )
        array_types["left"] = (array_types["left"][0], (_VIEWS,))
        lengths = dict.fromkeys(row_names.values(), range(self.gaussians + 1)) | {
            GAUSSIANS: range(1, self.gaussians + 1),
            _VIEWS: range(self.views + 1),
        }
        return Layout(array_types, lengths)

    def are_valid(self, arrays: Arrays) -> bool:
        """Return whether this training run could have produced the values of the arrays."""
        second_moments = [array for name, array in arrays.items() if name.endswith(".exp_avg_sq")]
        return (
            0 < int(arrays["step"]) <= self.iterations
            and all(0 <= view < self.views for view in arrays["left"].tolist())
            and all(bool(np.isfinite(array).all()) for array in arrays.values())
            and all(bool((array >= 0).all()) for array in second_moments)
            and _is_generator_state(arrays["generator"])
        )


def _is_generator_state(state: NDArray[np.uint8]) -> bool:
    try:
        torch.Generator().set_state(torch.from_numpy(state))
    except RuntimeError:
        return False
    return True
