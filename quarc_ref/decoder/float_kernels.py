"""Planes of integers to rows of floats (SPEC 10.1), compiled; `dequantize` has the plain twin."""

import numpy as np

from quarc_ref.format.compiled import entrance

_BLOCK = 128  # Gaussians whose rows stay in the nearest cache from plane to plane


@entrance
def scale(planes, step, rows, first):
    """Write planes `[r, N]`, times a step, to columns from `first` of float32 `[N, c]`."""
    for begin in range(0, planes.shape[1], _BLOCK):
        for row in range(planes.shape[0]):
            plane = planes[row, begin : begin + _BLOCK]
            column = rows[begin : begin + _BLOCK, first + row]
            for i in range(plane.size):
                column[i] = np.float32(plane[i]) * step
