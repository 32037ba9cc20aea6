"""Codes integers as planes of bits: SPEC 8.4.

There are three kinds of sequences: numbers of fixed width, unsigned numbers, and signed
numbers. For each kind, one function both encodes and decodes (see `planes`). The class of a number
is its bit length; its mantissa consists of the bits below its leading 1. The names of the models
that a sequence uses begin with the name of the sequence.
"""

import numpy as np

from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.planes import Planes
from quarc_ref.format.constants import MODELLED_BITS


def code_fixed(planes: Planes, name: str, contexts: Int64, width: int, values: Int64) -> Int64:
    """Code numbers below 2^width; the context of a bit includes the higher bits of its number.

    Args:
        planes: A `PlaneWriter` to encode, or a `PlaneReader` to decode.
        name: Name of the sequence.
        contexts: `[n]` context of each number, which is part of the context of each of its bits.
        width: Number of bits of a number.
        values: `[n]` numbers to encode; ignored when decoding.

    Returns:
        The `[n]` coded numbers.
    """
    prefix = np.ones_like(contexts)
    for bit_index in reversed(range(width)):
        prefix_contexts = (contexts << width) + prefix
        prefix = 2 * prefix + planes.code(
            f"{name}, class", prefix_contexts, _get_bits(values, bit_index)
        )
    return prefix - (1 << width)


def code_unsigned(
    planes: Planes, name: str, contexts: Int64, class_bits: int, values: Int64
) -> Int64:
    """Code unsigned numbers, each as a class and a mantissa.

    Args:
        planes: A `PlaneWriter` to encode, or a `PlaneReader` to decode.
        name: Name of the sequence.
        contexts: `[n]` context of each number, which is part of the context of each of its bits.
        class_bits: Number of bits of a class; the numbers are below 2^(2^class_bits - 1).
        values: `[n]` numbers to encode; ignored when decoding.

    Returns:
        The `[n]` coded numbers.
    """
    classes = code_fixed(planes, name, contexts, class_bits, bit_length(values))
    return _code_mantissas(planes, name, (contexts << class_bits) + classes, classes, values)


def code_signed(
    planes: Planes, name: str, contexts: Int64, class_bits: int, values: Int64
) -> Int64:
    """Code signed numbers, each as the class of its magnitude, its sign and the mantissa.

    Args:
        planes: A `PlaneWriter` to encode, or a `PlaneReader` to decode.
        name: Name of the sequence.
        contexts: `[n]` context of each number, which is part of the context of each of its bits.
        class_bits: Number of bits of a class; magnitudes are below 2^(2^class_bits - 1).
        values: `[n]` numbers to encode; ignored when decoding.

    Returns:
        The `[n]` coded numbers.
    """
    magnitudes = np.abs(values)
    classes = code_fixed(planes, name, contexts, class_bits, bit_length(magnitudes))
    contexts = (contexts << class_bits) + classes
    nonzero = np.flatnonzero(classes)
    negative = np.zeros_like(contexts)
    negative[nonzero] = planes.code(f"{name}, sign", contexts[nonzero], values[nonzero] < 0)
    magnitudes = _code_mantissas(planes, name, 2 * contexts + negative, classes, magnitudes)
    return np.where(negative, -magnitudes, magnitudes)


def _code_mantissas(
    planes: Planes, name: str, contexts: Int64, classes: Int64, values: Int64
) -> Int64:
    """Code the bits below each number's leading 1; only the first two have contexts."""
    mantissas = np.minimum(classes, 1)
    for depth in range(int(classes.max(initial=1)) - 1):
        indices = np.flatnonzero(classes > depth + 1)
        bits = _get_bits(values[indices], classes[indices] - 2 - depth)
        if depth < MODELLED_BITS:
            prefix_contexts = (contexts[indices] << MODELLED_BITS) + mantissas[indices]
            bits = planes.code(f"{name}, mantissa", prefix_contexts, bits)
        else:
            bits = planes.code_raw(bits)
        mantissas[indices] = 2 * mantissas[indices] + bits
    return mantissas


def _get_bits(values: Int64, index: Int64 | int) -> Bits:
    return ((values >> index) & 1).astype(np.bool_)
