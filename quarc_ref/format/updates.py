"""The updates of single Gaussians in a frame, as a record: SPEC 7.8."""

from dataclasses import dataclass

from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import RESIDUAL_ROWS


@dataclass(frozen=True, slots=True)
class Updates:
    """The updates of single Gaussians in a frame (SPEC 7.8).

    Attributes:
        gaussians: `[u]` index in the scene of each that changes, ascending.
        dies: `[u]` whether it leaves.
        residuals: `[RESIDUAL_ROWS, u]` what is added to it, in steps: `TRANSLATION`, `ROTATION`
            and `CODES`; 0 where it leaves.
    """

    gaussians: Int64
    dies: Bits
    residuals: Int64

    @property
    def count(self) -> int:
        """How many Gaussians change."""
        return int(self.gaussians.size)


TRANSLATION = slice(0, 3)
ROTATION = slice(3, 6)
CODES = slice(6, RESIDUAL_ROWS)  # of the state's codes, the first: all but SH rest
# The rows of each field of an update, in the order in which fields are coded (SPEC 8.8).
UPDATE_FIELDS = {
    "translation": TRANSLATION,
    "rotation": ROTATION,
    "log-scales": slice(6, 9),
    "opacity": slice(9, 10),
    "SH DC": slice(10, 13),
}
