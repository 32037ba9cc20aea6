"""What a mutant is."""

from dataclasses import dataclass

Edit = tuple[str, str, str]
"""File in quarc_ref, a text that is there exactly once, text in its place."""


@dataclass(frozen=True)
class Mutant:
    """A mistake that a decoder might make, as changes of the reference decoder's source.

    Attributes:
        name: What the decoder does.
        edits: How it comes to do it.
        alone: The category of vectors that is to catch it, and no other: without
            that category it would survive. Empty where nothing is said.
    """

    name: str
    edits: tuple[Edit, ...]
    alone: str = ""


def mutant(name: str, file: str, *texts: str, alone: str = "") -> Mutant:
    """Return a mutant of one file: texts that are there, each followed by the one in its place."""
    pairs = zip(texts[::2], texts[1::2], strict=True)
    return Mutant(name, tuple((file, old, new) for old, new in pairs), alone)
