"""Integers as planes of bits (SPEC 8.4), compiled; `values` holds the plain twins.

The context of a bit is what is known of its number by then. So the numbers that
share a context stand together once and for all: a bit parts each run of them in
two, and nothing has to be sorted again. Coders are those of `plane_kernels`.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain
from quarc_ref.format.plane_kernels import read_raw, sort_runs, split_runs

FIXED, UNSIGNED, SIGNED = 0, 1, 2
_MODELLED_BITS = 2


@entrance
def read_numbers(coder, contexts, width, form, counts):
    """Read numbers of a fixed width, or by class, maybe sign, and mantissa.

    Args:
        coder: Moves on.
        contexts: int64 `[n]` outer context of each number, n at least 1.
        width: Bits of a number, or of a class.
        form: `FIXED`, `UNSIGNED` or `SIGNED`.
        counts: int64 `[2, c]` of the models of classes, signs and mantissas; those
            that the form has learn.

    Returns:
        int64 `[n]` numbers, and a probability code that is undefined, -1 if none is.
    """
    signs, mask = np.int64(form == SIGNED), (1 << width) - 1
    numbers = np.zeros(contexts.size, dtype=np.int64)
    order, runs, undefined = _read_classes(coder, contexts, width, counts[0])
    runs = runs[:, runs[3] > 0]
    if form == FIXED:
        _write(numbers, order, runs, signs)
        return numbers, undefined
    runs[2] = (runs[2] << width) + runs[3]
    if signs and undefined < 0 and runs.shape[1]:
        runs[3] = 0
        runs, undefined = _read_bit(coder, runs, runs[2], order, counts[1])
        runs[2] = 2 * runs[2] + runs[3]
    runs[3] = 1
    for depth in range(_MODELLED_BITS):
        classes = (runs[2] >> signs) & mask
        _write(numbers, order, runs[:, classes == depth + 1], signs)
        runs = runs[:, classes > depth + 1]
        if undefined >= 0 or runs.shape[1] == 0:
            return numbers, undefined
        asked = (runs[2] << _MODELLED_BITS) + runs[3]
        runs, undefined = _read_bit(coder, runs, asked, order, counts[2])
    _write(numbers, order, runs, signs)
    if undefined < 0:
        _read_rest(coder, numbers, order, runs, (runs[2] >> signs) & mask)
    return numbers, undefined


@plain
def _read_classes(coder, contexts, width, counts):
    """Read numbers below 2^width, each bit in the context of those above it.

    Returns:
        int32 `[n]` the elements by context and number; int64 `[4, r]` where the
        elements of one context and number begin in that order, where they end, the
        context, and the number; and a code as above.
    """
    order, used, borders = sort_runs(contexts)
    runs = np.empty((4, used.size), dtype=np.int64)
    runs[0], runs[1], runs[2], runs[3] = borders[:-1], borders[1:], used, 1
    undefined = np.int64(-1)
    for _ in range(width):
        if undefined < 0:
            asked = (runs[2] << width) + runs[3]
            runs, undefined = _read_bit(coder, runs, asked, order, counts)
    runs[3] -= 1 << width
    return order, runs, undefined


@plain
def _read_bit(coder, runs, asked, order, counts):
    """Read one more bit of the numbers of runs; return the runs it makes, and a code as above."""
    zeros, undefined = split_runs(coder, asked, runs, order, counts)
    parted = np.empty((4, 2 * runs.shape[1]), dtype=np.int64)
    found = 0
    for run in range(runs.shape[1]):
        first, last = runs[0, run], runs[1, run]
        middle = first + zeros[run]
        for bit in range(2):
            begin, end = (middle, last) if bit else (first, middle)
            parted[0, found], parted[1, found] = begin, end
            parted[2, found], parted[3, found] = runs[2, run], 2 * runs[3, run] + bit
            found += end > begin
    return parted[:, :found].copy(), undefined


@plain
def _write(numbers, order, runs, signs):
    """Write the numbers of runs to their elements; the lowest bit of a context may be a sign."""
    for run in range(runs.shape[1]):
        number = -runs[3, run] if signs & runs[2, run] else runs[3, run]
        for i in range(runs[0, run], runs[1, run]):
            numbers[order[i]] = number


@plain
def _read_rest(coder, numbers, order, runs, classes):
    """Read the bits below those that are modelled, of all numbers of runs that have some."""
    class_of = np.zeros(numbers.size, dtype=np.uint8)
    for run in range(runs.shape[1]):
        for i in range(runs[0, run], runs[1, run]):
            class_of[order[i]] = classes[run]
    there = np.flatnonzero(class_of)
    for depth in range(_MODELLED_BITS, classes.max() - 1):
        there = there[class_of[there] > depth + 1]
        bits = read_raw(coder, there.size)
        for i in range(there.size):
            number = numbers[there[i]]
            numbers[there[i]] = 2 * number + (bits[i] if number > 0 else -np.int64(bits[i]))
