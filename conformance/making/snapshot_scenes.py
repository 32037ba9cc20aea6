"""Hand-written snapshots, and patterns that fill them (SPEC 7.9)."""

from collections.abc import Iterable
from dataclasses import replace

from making.changes import Survivor
from making.payloads import Head
from making.scenes import between, pick, place_numbers

FIELDS = {
    "position": range(3),
    "rotation": range(3, 7),
    "log-scales": range(7, 10),
    "opacity": range(10, 11),
    "sh-dc": range(11, 14),
}
NEEDS = {"needs": "snapshots"}
"""Decoders of 1.0 are not tested with these streams, which they reject."""


def snapshot_head(**fields: int) -> Head:
    """Return the HEAD of a stream with snapshots."""
    return replace(Head(version_minor=1, incompatible_features=4), **fields)


def differences(**said: tuple[int, ...] | int) -> tuple[int, ...]:
    """Return the 14 differences of fields, `sh_dc` for SH DC; missing fields are 0."""
    return place_numbers(FIELDS, said)


def survive(which: Iterable[int], seed: int = 0) -> tuple[Survivor, ...]:
    """Return survivors that each differ in some fields; the rotation index does not change."""
    return tuple(_draw(i, seed) for i in which)


def _draw(i: int, seed: int) -> Survivor:
    rows = [between(-5, 5, seed, i, 2, row) for row in range(14)]
    rows[3] = 0
    for number, field in enumerate(FIELDS.values()):
        if pick(seed, i, 3, number) % 2:
            rows[field.start : field.stop] = [0] * len(field)
    return Survivor(i, tuple(rows))


def unchanged_survivors(which: Iterable[int]) -> tuple[Survivor, ...]:
    """Return survivors without differences."""
    return tuple(Survivor(i) for i in which)
