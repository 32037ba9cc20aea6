"""Histograms of the magnitudes of motion symbols."""

from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from quarc_ref.format.arrays import Int64

_TRANSLATION_ROWS = 3


@dataclass(frozen=True, slots=True)
class MagnitudeHistograms:
    """Numbers of symbols with each magnitude, from 0 to the largest magnitude.

    Attributes:
        translation: Histogram of the x, y and z components of translation residuals.
        rotation: Histogram of the components of rotation residuals: x, y, z and, in streams that
            code it, w.
    """

    translation: tuple[int, ...]
    rotation: tuple[int, ...]

    def __add__(self, other: "MagnitudeHistograms") -> "MagnitudeHistograms":
        return MagnitudeHistograms(
            _add_histograms(self.translation, other.translation),
            _add_histograms(self.rotation, other.rotation),
        )

    def as_json(self) -> dict[str, list[int]]:
        """Return both histograms by name."""
        return {"translation": list(self.translation), "rotation": list(self.rotation)}


def count_magnitudes(symbols: tuple[Int64, ...]) -> MagnitudeHistograms:
    """Compute the histograms of a frame's symbols.

    Args:
        symbols: `[c, a]` symbols of each level's anchors; empty in a canonical frame.
    """
    if not symbols:
        return MagnitudeHistograms((), ())
    magnitudes = np.abs(np.concatenate(symbols, axis=1))
    return MagnitudeHistograms(
        tuple(np.bincount(magnitudes[:_TRANSLATION_ROWS].reshape(-1)).tolist()),
        tuple(np.bincount(magnitudes[_TRANSLATION_ROWS:].reshape(-1)).tolist()),
    )


def _add_histograms(
    first_counts: tuple[int, ...], second_counts: tuple[int, ...]
) -> tuple[int, ...]:
    return tuple(
        first + second for first, second in zip_longest(first_counts, second_counts, fillvalue=0)
    )
