"""What is made by hand: Gaussians as they are coded, and what a frame does to them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from making.writing import State

Symbols = Callable[[int, int], Sequence[int] | None]
"""Of a level and an anchor: its symbols; None for one that does not move."""


def _stay(_level: int, _anchor: int) -> None:
    return None


def say_nothing(_model: str, _context: int, _zeros: int, _ones: int) -> None:
    """State no probability."""
    return


@dataclass(frozen=True)
class Coded:
    """A Gaussian as it is coded.

    Attributes:
        position: In position steps; of a newborn, less the parent's.
        rotation: j, a, b, c of SPEC 7.2.
        codes: Log-scales 3, opacity, SH DC 3, maybe SH rest 9.
        parent: Of a newborn, the index of its parent.
    """

    position: tuple[int, int, int]
    rotation: tuple[int, int, int, int] = (0, 0, 0, 0)
    codes: tuple[int, ...] = (-40, -40, -40, 10, 0, 0, 0)
    parent: int = 0


@dataclass(frozen=True)
class Update:
    """What a frame does to one Gaussian (SPEC 7.8).

    Attributes:
        gaussian: Its index in the scene after the motion.
        residuals: The 13; None of one that leaves.
        fields: The fields that are answered yes, a bit to each; None for those with a residual
            that is not 0.
    """

    gaussian: int
    residuals: tuple[int, ...] | None = (0,) * 13
    fields: int | None = None


@dataclass(frozen=True)
class Survivor:
    """A Gaussian of the last CANO that a snapshot still has (SPEC 7.9).

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
    """What a FRAM chunk does.

    Attributes:
        symbols: Of the anchors.
        births: The newborn, in ascending order of their parents.
        deaths: How many leave.
        previous: Whether the last frame's motion gives contexts.
        stating: Which codes the planes state.
        motion: Words in place of those of the symbols.
        newborn: Words in place of those of the births.
        updates: Of single Gaussians, in ascending order of their indices.
        updated: Words in place of those of the updates.
    """

    symbols: Symbols = _stay
    births: tuple[Coded, ...] = ()
    deaths: int = 0
    previous: int = 1
    stating: State = say_nothing
    motion: tuple[int, ...] | None = None
    newborn: tuple[int, ...] | None = None
    updates: tuple[Update, ...] = ()
    updated: tuple[int, ...] | None = None
