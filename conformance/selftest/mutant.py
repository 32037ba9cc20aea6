"""The form of a mutant."""

from dataclasses import dataclass

Edit = tuple[str, str, str]
"""File in quarc_ref, a text that occurs exactly once, and its replacement."""


@dataclass(frozen=True)
class Mutant:
    """A mistake that a decoder might make, as changes of the reference decoder's source.

    Attributes:
        name: The resulting behavior of the decoder.
        edits: Changes of the source.
        alone: The only category of vectors that may detect it: without this category it would
            survive. Empty if this is not tested.
    """

    name: str
    edits: tuple[Edit, ...]
    alone: str = ""


def mutant(name: str, file: str, *texts: str, alone: str = "") -> Mutant:
    """Return a mutant of one file: pairs of a text and its replacement."""
    pairs = zip(texts[::2], texts[1::2], strict=True)
    return Mutant(name, tuple((file, old, new) for old, new in pairs), alone)
