"""Pseudorandom survivors with various differences, for snapshots (SPEC 7.9)."""

from collections.abc import Iterable
from dataclasses import replace

from making.changes import Survivor
from making.payloads import Head
from making.scenes import fill_fields, hash_numbers, pick_between

FIELD_RANGES = {
    "position": range(3),
    "rotation": range(3, 7),
    "log-scales": range(7, 10),
    "opacity": range(10, 11),
    "sh-dc": range(11, 14),
}
REQUIRED_CAPABILITY = {"needs": "snapshots"}
"""Only decoders with this capability are tested with streams that contain snapshots."""


def make_snapshot_head(**fields: int) -> Head:
    """Return the HEAD of a stream with snapshots."""
    return replace(Head(version_minor=1, incompatible_features=4), **fields)


def make_differences(**values_by_field: tuple[int, ...] | int) -> tuple[int, ...]:
    """Return all 14 differences; the differences of fields that are not given are 0."""
    return fill_fields(FIELD_RANGES, values_by_field)


def make_random_survivors(indices: Iterable[int], seed: int = 0) -> tuple[Survivor, ...]:
    """Return survivors with pseudorandom differences; rotation indices do not change."""
    return tuple(_make_random_survivor(i, seed) for i in indices)


def _make_random_survivor(i: int, seed: int) -> Survivor:
    differences = [pick_between(-5, 5, seed, i, 2, row) for row in range(14)]
    differences[3] = 0
    for number, field in enumerate(FIELD_RANGES.values()):
        if hash_numbers(seed, i, 3, number) % 2:
            differences[field.start : field.stop] = [0] * len(field)
    return Survivor(i, tuple(differences))


def make_unchanged_survivors(indices: Iterable[int]) -> tuple[Survivor, ...]:
    """Return survivors without differences."""
    return tuple(Survivor(i) for i in indices)
