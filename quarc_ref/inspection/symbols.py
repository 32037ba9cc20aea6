"""Histograms of the magnitudes of motion symbols."""

from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from quarc_ref.format.arrays import Int64

_TRANSLATION_ROWS = 3


@dataclass(frozen=True, slots=True)
class Magnitudes:
    """Number of symbols for each magnitude from 0 to the largest one.

    Attributes:
        translation: Magnitudes of x, y and z.
        rotation: Magnitudes of x, y and z, and of w if residuals have it.
    """

    translation: tuple[int, ...]
    rotation: tuple[int, ...]

    def __add__(self, other: "Magnitudes") -> "Magnitudes":
        return Magnitudes(
            _sum(self.translation, other.translation), _sum(self.rotation, other.rotation)
        )

    def as_json(self) -> dict[str, list[int]]:
        """Return both histograms by name."""
        return {"translation": list(self.translation), "rotation": list(self.rotation)}


def count_magnitudes(symbols: tuple[Int64, ...]) -> Magnitudes:
    """Compute the histograms of a frame's symbols.

    Args:
        symbols: `[c, a]` symbols of each level's anchors; empty in a canonical frame.
    """
    if not symbols:
        return Magnitudes((), ())
    magnitudes = np.abs(np.concatenate(symbols, axis=1))
    return Magnitudes(
        tuple(np.bincount(magnitudes[:_TRANSLATION_ROWS].reshape(-1)).tolist()),
        tuple(np.bincount(magnitudes[_TRANSLATION_ROWS:].reshape(-1)).tolist()),
    )


def _sum(counts: tuple[int, ...], others: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(mine + theirs for mine, theirs in zip_longest(counts, others, fillvalue=0))
