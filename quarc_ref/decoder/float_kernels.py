"""Planes of integers to rows of floats (SPEC 10.1), compiled; `dequantize` has the plain twin.

A single plane is its rows already. Rows of three and of four numbers are written whole, side
by side: the processor has instructions that weave so many planes into one. Others go by way
of a block of planes.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain

_BLOCK = 64  # Gaussians whose numbers stay in the nearest cache until they are rows


@entrance
def scale(planes, steps, rows):
    """Write planes of integers `[r, N]`, times steps float32 `[r]`, to float32 `[N, r]`."""
    if planes.shape[0] == 1:
        for i in range(planes.shape[1]):
            rows[i, 0] = np.float32(planes[0, i]) * steps[0]
    elif planes.shape[0] == 3:
        _weave_three(planes, steps, rows)
    elif planes.shape[0] == 4:
        _weave_four(planes, steps, rows)
    else:
        _weave(planes, steps, rows)


@plain
def _weave_three(planes, steps, rows):
    first, second, third = planes[0], planes[1], planes[2]
    a, b, c = steps[0], steps[1], steps[2]
    for i in range(first.size):
        rows[i, 0] = np.float32(first[i]) * a
        rows[i, 1] = np.float32(second[i]) * b
        rows[i, 2] = np.float32(third[i]) * c


@plain
def _weave_four(planes, steps, rows):
    first, second, third, fourth = planes[0], planes[1], planes[2], planes[3]
    a, b, c, d = steps[0], steps[1], steps[2], steps[3]
    for i in range(first.size):
        rows[i, 0] = np.float32(first[i]) * a
        rows[i, 1] = np.float32(second[i]) * b
        rows[i, 2] = np.float32(third[i]) * c
        rows[i, 3] = np.float32(fourth[i]) * d


@plain
def _weave(planes, steps, rows):
    scaled = np.empty((planes.shape[0], _BLOCK), dtype=np.float32)
    for begin in range(0, planes.shape[1], _BLOCK):
        block = rows[begin : begin + _BLOCK]
        for number in range(planes.shape[0]):
            plane, floats = planes[number, begin : begin + _BLOCK], scaled[number]
            step = steps[number]
            for i in range(plane.size):
                floats[i] = np.float32(plane[i]) * step
        for i in range(block.shape[0]):
            for number in range(planes.shape[0]):
                block[i, number] = scaled[number, i]
