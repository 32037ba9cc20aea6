"""Pseudorandom updates with various residuals, for frames (SPEC 7.8)."""

from collections.abc import Iterable
from dataclasses import replace

from making.changes import Update
from making.payloads import Head
from making.scenes import fill_fields, hash_numbers, pick_between

FIELD_RANGES = {
    "translation": range(3),
    "rotation": range(3, 6),
    "log-scales": range(6, 9),
    "opacity": range(9, 10),
    "sh-dc": range(10, 13),
}
REQUIRED_CAPABILITY = {"needs": "updates"}
"""Only decoders with this capability are tested with streams that contain updates."""


def make_update_head(**fields: int) -> Head:
    """Return the HEAD of a stream with updates."""
    return replace(Head(version_minor=1, incompatible_features=2), **fields)


def make_residuals(**values_by_field: tuple[int, ...] | int) -> tuple[int, ...]:
    """Return all 13 residuals; the residuals of fields that are not given are 0."""
    return fill_fields(FIELD_RANGES, values_by_field)


def make_random_updates(
    count: int, seed: int, *, gaussians_per_update: int = 3, updates_per_deletion: int = 7
) -> tuple[Update, ...]:
    """Return pseudorandom updates of some Gaussians; Gaussian 0 is never deleted."""
    indices = [i for i in range(count) if hash_numbers(seed, i) % gaussians_per_update == 0]
    return tuple(_make_random_update(i, seed, updates_per_deletion) for i in indices)


def _make_random_update(i: int, seed: int, updates_per_deletion: int) -> Update:
    if i and hash_numbers(seed, i, 1) % updates_per_deletion == 0:
        return Update(i, None)
    residuals = [pick_between(-5, 5, seed, i, 2, row) for row in range(13)]
    for number, field in enumerate(FIELD_RANGES.values()):
        if hash_numbers(seed, i, 3, number) % 2:
            residuals[field.start : field.stop] = [0] * len(field)
    return Update(i, tuple(residuals))


def make_equal_updates(count: int, residuals: tuple[int, ...]) -> tuple[Update, ...]:
    """Return an update with the same residuals for every Gaussian."""
    return tuple(Update(i, residuals) for i in range(count))


def make_deleting_updates(indices: Iterable[int]) -> tuple[Update, ...]:
    """Return updates that delete the Gaussians at `indices`."""
    return tuple(Update(i, None) for i in indices)
