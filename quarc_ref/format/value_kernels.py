"""Integers as planes of bits (SPEC 8.4), compiled; `values` holds the plain twins.

Coders are those of `plane_kernels`.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain
from quarc_ref.format.plane_kernels import read_plane, read_raw

_MODELLED_BITS = 2


@entrance
def read_fixed(coder, contexts, width, counts):
    """Read numbers below 2^width.

    Args:
        coder: Moves on.
        contexts: int64 `[n]` outer context of each number, n at least 1.
        width: Bits of a number.
        counts: int64 `[2, c]` of the model of classes; learns.

    Returns:
        int64 `[n]` numbers, and a probability code that is undefined, -1 if none is.
    """
    nodes = np.ones(contexts.size, dtype=np.int64)
    asked = np.empty(contexts.size, dtype=np.int32)
    for _ in range(width):
        for i in range(asked.size):
            asked[i] = (contexts[i] << width) + nodes[i]
        bits, undefined = read_plane(coder, asked, counts)
        if undefined >= 0:
            return nodes, undefined
        for i in range(asked.size):
            nodes[i] = 2 * nodes[i] + bits[i]
    return nodes - (1 << width), -1


@entrance
def read_classed(coder, contexts, class_bits, signed, counts):
    """Read numbers by class, maybe sign, and mantissa.

    Args:
        coder: Moves on.
        contexts: int64 `[n]` outer context of each number, n at least 1.
        class_bits: Width of a class.
        signed: Whether there are signs.
        counts: int64 `[2, c]` of the models of classes, signs and mantissas; learn.

    Returns:
        As `read_fixed`.
    """
    classes, undefined = read_fixed(coder, contexts, class_bits, counts[0])
    if undefined >= 0:
        return classes, undefined
    contexts = (contexts << class_bits) + classes
    there = np.flatnonzero(classes)
    negative = np.zeros(there.size, dtype=np.bool_)
    if signed and there.size:
        negative, undefined = read_plane(coder, contexts[there], counts[1])
        if undefined >= 0:
            return classes, undefined
        contexts *= 2
        for i in range(there.size):
            contexts[there[i]] += negative[i]
    numbers, undefined = _read_mantissas(coder, contexts, classes, counts[2])
    for i in range(there.size):
        if negative[i]:
            numbers[there[i]] = -numbers[there[i]]
    return numbers, undefined


@plain
def _read_mantissas(coder, contexts, classes, counts):
    """Read the bits below the leading 1 of numbers: the first few modelled, the rest raw."""
    known = np.minimum(classes, 1)
    there = np.arange(classes.size)
    for depth in range(classes.max() - 1):
        there = there[classes[there] > depth + 1]
        if depth < _MODELLED_BITS:
            asked = (contexts[there] << _MODELLED_BITS) + known[there]
            bits, undefined = read_plane(coder, asked, counts)
            if undefined >= 0:
                return known, undefined
        else:
            bits = read_raw(coder, there.size)
        for i in range(there.size):
            known[there[i]] = 2 * known[there[i]] + bits[i]
    return known, -1
