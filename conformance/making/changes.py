"""Hand-written content of frames: coded Gaussians, motion, births, updates and survivors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from making.writing import StateCode

Symbols = Callable[[int, int], Sequence[int] | None]
"""Returns the symbols of an anchor, given its level and index; None if the anchor does not move."""


def _give_no_symbols(_level: int, _anchor: int) -> None:
    return None


def state_no_code(_model: str, _context: int, _zeros: int, _ones: int) -> None:
    """Return None: the plane states no probability code."""
    return


@dataclass(frozen=True)
class CodedGaussian:
    """A coded Gaussian of a canonical frame, or a birth.

    Attributes:
        position: Position in position steps; for a birth, relative to the parent.
        rotation: (j, a, b, c) of SPEC 7.2.
        codes: 3 log-scales, opacity, 3 SH DC, and optionally 9 SH rest.
        parent: Index of the parent, for a birth.
    """

    position: tuple[int, int, int]
    rotation: tuple[int, int, int, int] = (0, 0, 0, 0)
    codes: tuple[int, ...] = (-40, -40, -40, 10, 0, 0, 0)
    parent: int = 0


@dataclass(frozen=True)
class Update:
    """The update of one Gaussian (SPEC 7.8).

    Attributes:
        gaussian: Index of the Gaussian in the scene after the motion.
        residuals: The 13 residuals; None if the Gaussian leaves.
        field_mask: Changed fields, a bit for each; None for the fields with a nonzero residual.
    """

    gaussian: int
    residuals: tuple[int, ...] | None = (0,) * 13
    field_mask: int | None = None


@dataclass(frozen=True)
class Survivor:
    """A Gaussian of the last CANO that a snapshot keeps (SPEC 7.9).

    Attributes:
        index: Index of the Gaussian in the CANO.
        differences: The 14 differences.
        field_mask: As in `Update`.
    """

    index: int
    differences: tuple[int, ...] = (0,) * 14
    field_mask: int | None = None


@dataclass(frozen=True)
class Change:
    """The content of a FRAM chunk.

    Attributes:
        symbols: Symbols of the anchors.
        births: The births, in ascending order of their parents.
        deaths: Number of Gaussians that die.
        previous_contexts: 1 if the motion of the previous frame provides contexts, otherwise 0.
        state_code: Returns the probability code that a plane states for a context.
        motion_words: Words that replace those of the section of motion.
        birth_words: Words that replace those of the section of births.
        updates: Updates in ascending order of their Gaussians' indices.
        update_words: Words that replace those of the section of updates.
    """

    symbols: Symbols = _give_no_symbols
    births: tuple[CodedGaussian, ...] = ()
    deaths: int = 0
    previous_contexts: int = 1
    state_code: StateCode = state_no_code
    motion_words: tuple[int, ...] | None = None
    birth_words: tuple[int, ...] | None = None
    updates: tuple[Update, ...] = ()
    update_words: tuple[int, ...] | None = None
