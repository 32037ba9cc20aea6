"""Planes of integers to rows of floats (SPEC 10.1), compiled; `dequantize` has the plain twin."""

import numpy as np

from quarc_ref.format.compiled import entrance


@entrance
def scale(planes, step, rows, first):
    """Write planes int32 `[r, N]`, times a step, to columns from `first` of float32 `[N, c]`."""
    for row in range(planes.shape[0]):
        plane, column = planes[row], rows[:, first + row]
        for i in range(plane.size):
            column[i] = np.float32(plane[i]) * step
