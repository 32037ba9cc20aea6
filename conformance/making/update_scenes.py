"""Hand-written updates, and patterns that fill frames with them (SPEC 7.8)."""

from collections.abc import Iterable
from dataclasses import replace

from making.changes import Update
from making.payloads import Head
from making.scenes import between, pick, place_numbers

FIELDS = {
    "translation": range(3),
    "rotation": range(3, 6),
    "log-scales": range(6, 9),
    "opacity": range(9, 10),
    "sh-dc": range(10, 13),
}
NEEDS = {"needs": "updates"}
"""Decoders of 1.0 are not tested with these streams, which they reject."""


def update_head(**fields: int) -> Head:
    """Return the HEAD of a stream with updates."""
    return replace(Head(version_minor=1, incompatible_features=2), **fields)


def residuals(**said: tuple[int, ...] | int) -> tuple[int, ...]:
    """Return the 13 residuals of fields, `sh_dc` for SH DC; missing fields are 0."""
    return place_numbers(FIELDS, said)


def drawn(count: int, seed: int, *, one_in: int = 3, leaving: int = 7) -> tuple[Update, ...]:
    """Return updates of some Gaussians in some fields each; the first one does not leave."""
    chosen = [i for i in range(count) if pick(seed, i) % one_in == 0]
    return tuple(_draw(i, seed, leaving) for i in chosen)


def _draw(i: int, seed: int, leaving: int) -> Update:
    if i and pick(seed, i, 1) % leaving == 0:
        return Update(i, None)
    rows = [between(-5, 5, seed, i, 2, row) for row in range(13)]
    for number, field in enumerate(FIELDS.values()):
        if pick(seed, i, 3, number) % 2:
            rows[field.start : field.stop] = [0] * len(field)
    return Update(i, tuple(rows))


def of_all(count: int, said: tuple[int, ...]) -> tuple[Update, ...]:
    """Return the same update of all Gaussians."""
    return tuple(Update(i, said) for i in range(count))


def leaving(which: Iterable[int]) -> tuple[Update, ...]:
    """Return updates that make Gaussians leave."""
    return tuple(Update(i, None) for i in which)
