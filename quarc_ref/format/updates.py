"""A record of the updates of individual Gaussians in a frame: SPEC 7.8."""

from dataclasses import dataclass

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import RESIDUAL_ROWS


@dataclass(frozen=True, slots=True)
class Updates:
    """The updates of individual Gaussians in a frame (SPEC 7.8).

    Attributes:
        gaussians: `[u]` ascending indices in the scene of the Gaussians that change or are deleted.
        dies: `[u]` whether each of these Gaussians is deleted.
        residuals: `[RESIDUAL_ROWS, u]` residuals in quantization steps, in the rows
            `TRANSLATION`, `ROTATION` and `CODES`; 0 for deleted Gaussians.
    """

    gaussians: Int64
    dies: Bits
    residuals: Int64

    @property
    def count(self) -> int:
        """Number of Gaussians that change or are deleted."""
        return int(self.gaussians.size)


TRANSLATION = slice(0, 3)
ROTATION = slice(3, 6)
CODES = slice(6, RESIDUAL_ROWS)  # the first codes of the state: all but SH rest
# Rows of each field of an update, in coding order (SPEC 8.8).
UPDATE_FIELDS = {
    "translation": TRANSLATION,
    "rotation": ROTATION,
    "log-scales": slice(6, 9),
    "opacity": slice(9, 10),
    "SH DC": slice(10, 13),
}
