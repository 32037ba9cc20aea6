"""Codes integers as planes of bits: SPEC 8.4.

There are three forms: numbers of fixed width, unsigned numbers, and signed numbers. Each
is one walk that serves both encoding and decoding; the given numbers are ignored when
decoding (see `planes`). The planes of a sequence of numbers belong to models with its
name.
"""

import numpy as np

from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.planes import Planes
from quarc_ref.format.constants import MODELLED_BITS


def code_fixed(planes: Planes, name: str, contexts: Int64, width: int, values: Int64) -> Int64:
    """Code numbers below 2^width; the context of a bit is the bits above it.

    Args:
        planes: Planes of the walk.
        name: Name of the sequence.
        contexts: `[n]` outer context of each number.
        width: Number of bits of a number.
        values: `[n]` numbers.

    Returns:
        `[n]` numbers.
    """
    node = np.ones_like(contexts)
    for place in reversed(range(width)):
        asked = (contexts << width) + node
        node = 2 * node + planes.code(f"{name}, class", asked, _bit(values, place))
    return node - (1 << width)


def code_unsigned(
    planes: Planes, name: str, contexts: Int64, class_bits: int, values: Int64
) -> Int64:
    """Code unsigned numbers: class, then mantissa.

    Args:
        planes: Planes of the walk.
        name: Name of the sequence.
        contexts: `[n]` outer context of each number.
        class_bits: Number of bits of a class; the numbers are below 2^(2^class_bits - 1).
        values: `[n]` numbers.

    Returns:
        `[n]` numbers.
    """
    classes = code_fixed(planes, name, contexts, class_bits, bit_length(values))
    return _code_mantissas(planes, name, (contexts << class_bits) + classes, classes, values)


def code_signed(
    planes: Planes, name: str, contexts: Int64, class_bits: int, values: Int64
) -> Int64:
    """Code signed numbers: class, sign, mantissa of the magnitude.

    Args:
        planes: Planes of the walk.
        name: Name of the sequence.
        contexts: `[n]` outer context of each number.
        class_bits: Number of bits of a class; magnitudes are below 2^(2^class_bits - 1).
        values: `[n]` numbers.

    Returns:
        `[n]` numbers.
    """
    magnitudes = np.abs(values)
    classes = code_fixed(planes, name, contexts, class_bits, bit_length(magnitudes))
    contexts = (contexts << class_bits) + classes
    there = np.flatnonzero(classes)
    negative = np.zeros_like(contexts)
    negative[there] = planes.code(f"{name}, sign", contexts[there], values[there] < 0)
    magnitudes = _code_mantissas(planes, name, 2 * contexts + negative, classes, magnitudes)
    return np.where(negative, -magnitudes, magnitudes)


def _code_mantissas(
    planes: Planes, name: str, contexts: Int64, classes: Int64, values: Int64
) -> Int64:
    """Code the bits below the leading 1 of numbers: the first ones with contexts, the rest raw."""
    known = np.minimum(classes, 1)
    for depth in range(int(classes.max(initial=1)) - 1):
        there = np.flatnonzero(classes > depth + 1)
        bits = _bit(values[there], classes[there] - 2 - depth)
        if depth < MODELLED_BITS:
            asked = (contexts[there] << MODELLED_BITS) + known[there]
            bits = planes.code(f"{name}, mantissa", asked, bits)
        else:
            bits = planes.code_raw(bits)
        known[there] = 2 * known[there] + bits
    return known


def _bit(values: Int64, place: Int64 | int) -> Bits:
    return ((values >> place) & 1).astype(np.bool_)
