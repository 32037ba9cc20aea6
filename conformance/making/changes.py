"""Hand-written content: Gaussians as they are coded, and the changes of a frame."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from making.writing import State

Symbols = Callable[[int, int], Sequence[int] | None]
"""The symbols of an anchor, given its level and index; None if it does not move."""


def _no_symbols(_level: int, _anchor: int) -> None:
    return None


def state_nothing(_model: str, _context: int, _zeros: int, _ones: int) -> None:
    """State no probability."""
    return


@dataclass(frozen=True)
class Coded:
    """A Gaussian as it is coded.

    Attributes:
        position: In position steps; for a newborn, relative to the parent.
        rotation: j, a, b, c of SPEC 7.2.
        codes: 3 log-scales, opacity, 3 SH DC, and optionally 9 SH rest.
        parent: For a newborn, the index of its parent.
    """

    position: tuple[int, int, int]
    rotation: tuple[int, int, int, int] = (0, 0, 0, 0)
    codes: tuple[int, ...] = (-40, -40, -40, 10, 0, 0, 0)
    parent: int = 0


@dataclass(frozen=True)
class Update:
    """The update of one Gaussian (SPEC 7.8).

    Attributes:
        gaussian: Its index in the scene after the motion.
        residuals: The 13 residuals; None if the Gaussian leaves.
        fields: The changed fields, a bit for each; None for those with a nonzero residual.
    """

    gaussian: int
    residuals: tuple[int, ...] | None = (0,) * 13
    fields: int | None = None


@dataclass(frozen=True)
class Survivor:
    """A Gaussian of the last CANO that a snapshot keeps (SPEC 7.9).

    Attributes:
        index: In the CANO.
        differences: The 14.
        fields: As of `Update`.
    """

    index: int
    differences: tuple[int, ...] = (0,) * 14
    fields: int | None = None


@dataclass(frozen=True)
class Change:
    """The content of a FRAM chunk.

    Attributes:
        symbols: Of the anchors.
        births: The births, in ascending order of their parents.
        deaths: How many leave.
        previous: Whether the motion of the previous frame provides contexts.
        stating: Which probability codes the planes state.
        motion: Words that replace those of the symbols.
        newborn: Words that replace those of the births.
        updates: Updates of single Gaussians, in ascending order of their indices.
        updated: Words that replace those of the updates.
    """

    symbols: Symbols = _no_symbols
    births: tuple[Coded, ...] = ()
    deaths: int = 0
    previous: int = 1
    stating: State = state_nothing
    motion: tuple[int, ...] | None = None
    newborn: tuple[int, ...] | None = None
    updates: tuple[Update, ...] = ()
    updated: tuple[int, ...] | None = None
