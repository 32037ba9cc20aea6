"""Estimates the bits that a code takes, from the histogram of all codes in its row."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.arrays import Int64

Float64 = NDArray[np.float64]
# The entropy coder shares a probability among neighboring codes, so a part of each count is spread.
_SPREAD_SHARE, _SPREAD_DEVIATION, _SPREAD_RADIUS = 0.15, 1.5, 6
_MIN_COUNT = 0.02  # codes that no Gaussian has take many bits, but not infinitely many


class CodeRates:
    """The bits of each code in rows of codes that are coded with separate contexts.

    Args:
        rows: `[n]` codes of each row.
    """

    def __init__(self, rows: Iterable[Int64]) -> None:
        self._tables = [_measure_table(codes) for codes in rows]

    def bits(self, rows: Iterable[Int64]) -> Float64:
        """Return the `[m]` sums of the bits of other codes, given as `[m]` codes of each row."""
        bits_by_row = [
            bits[np.clip(codes - lowest, 0, len(bits) - 1)]
            for (lowest, bits), codes in zip(self._tables, rows, strict=True)
        ]
        sums: Float64 = np.sum(bits_by_row, axis=0)
        return sums


def _measure_table(codes: Int64) -> tuple[int, Float64]:
    """Return the lowest code of a table, and the bits of this code and all codes after it."""
    lowest = int(codes.min()) - _SPREAD_RADIUS
    counts = np.bincount(codes - lowest, minlength=int(codes.max()) - lowest + _SPREAD_RADIUS + 1)
    distances = np.arange(-_SPREAD_RADIUS, _SPREAD_RADIUS + 1) / _SPREAD_DEVIATION
    kernel = np.exp(-0.5 * distances**2)
    spread = np.convolve(counts, kernel / kernel.sum(), "same")
    shares = (1 - _SPREAD_SHARE) * counts + _SPREAD_SHARE * spread + _MIN_COUNT
    bits: Float64 = -np.log2(shares / shares.sum())
    return lowest, bits
