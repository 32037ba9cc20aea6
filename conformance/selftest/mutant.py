"""Mutants: changes to the decoder's source code, each of which introduces a mistake."""

from dataclasses import dataclass

Edit = tuple[str, str, str]
"""(file in quarc_ref, text that occurs exactly once in the file, replacement of the text)."""


@dataclass(frozen=True)
class Mutant:
    """A mistake that a decoder might have, made by changing the source of the reference decoder.

    Attributes:
        name: Description of the wrong behavior.
        edits: Replacements of source text.
        only_category: The only category of vectors that detects the mutant; empty if this is not
            tested.
    """

    name: str
    edits: tuple[Edit, ...]
    only_category: str = ""


def make_mutant(name: str, file: str, *texts: str, only_category: str = "") -> Mutant:
    """Return a mutant that changes one file; `texts` alternates between old and new text."""
    pairs = zip(texts[::2], texts[1::2], strict=True)
    return Mutant(name, tuple((file, old, new) for old, new in pairs), only_category)
