"""Hand-written content of frames: coded Gaussians, motion, births, updates and survivors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from making.writing import CodeChoice

SymbolChoice = Callable[[int, int], Sequence[int] | None]
"""Function of (level, anchor) that returns the anchor's symbols; None if it does not move."""


def _return_no_symbols(_level: int, _anchor: int) -> None:
    return None


def choose_no_code(_model: str, _context: int, _zeros: int, _ones: int) -> None:
    """Return None: no probability code is written for the context."""
    return


@dataclass(frozen=True)
class CodedGaussian:
    """A coded Gaussian of a canonical frame, or a birth.

    Attributes:
        position: Position in position steps; for a birth, relative to the parent.
        rotation: The rotation as (j, a, b, c) (SPEC 7.2).
        codes: Codes of 3 log-scales, the opacity, 3 SH DC coefficients, and optionally 9 SH rest
            coefficients.
        parent: Index of the parent; used only for a birth.
    """

    position: tuple[int, int, int]
    rotation: tuple[int, int, int, int] = (0, 0, 0, 0)
    codes: tuple[int, ...] = (-40, -40, -40, 10, 0, 0, 0)
    parent: int = 0


@dataclass(frozen=True)
class Update:
    """The update of one Gaussian (SPEC 7.8).

    Attributes:
        gaussian_index: Index of the Gaussian in the scene after the motion.
        residuals: The 13 residuals; None if the update deletes the Gaussian.
        field_mask: Bit mask of the changed fields; None selects the fields with a nonzero residual.
    """

    gaussian_index: int
    residuals: tuple[int, ...] | None = (0,) * 13
    field_mask: int | None = None


@dataclass(frozen=True)
class Survivor:
    """A Gaussian of the last CANO that a snapshot keeps (SPEC 7.9).

    Attributes:
        index: Index of the Gaussian in the CANO.
        differences: The 14 differences from the Gaussian of the CANO.
        field_mask: Bit mask of the changed fields, as in `Update`.
    """

    index: int
    differences: tuple[int, ...] = (0,) * 14
    field_mask: int | None = None


@dataclass(frozen=True)
class Change:
    """The content of a FRAM chunk.

    Attributes:
        choose_symbols: Function that returns the symbols of an anchor, given its level and index.
        births: The births, in ascending order of their parents.
        death_count: Number of Gaussians that die.
        previous_contexts: 1 if contexts depend on the motion of the previous frame, otherwise 0.
        choose_code: Function that chooses the probability code to write for a context, if any.
        motion_words: Words that replace the encoded words of the motion section, if not None.
        birth_words: Words that replace the encoded words of the births section, if not None.
        updates: The updates, in ascending order of their Gaussians' indices.
        update_words: Words that replace the encoded words of the updates section, if not None.
    """

    choose_symbols: SymbolChoice = _return_no_symbols
    births: tuple[CodedGaussian, ...] = ()
    death_count: int = 0
    previous_contexts: int = 1
    choose_code: CodeChoice = choose_no_code
    motion_words: tuple[int, ...] | None = None
    birth_words: tuple[int, ...] | None = None
    updates: tuple[Update, ...] = ()
    update_words: tuple[int, ...] | None = None
